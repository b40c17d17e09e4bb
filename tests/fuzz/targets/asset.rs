//! `object.relit`: bytes that can be read as an asset are the same asset after writing and reading them again.

#![no_main]
#![allow(clippy::expect_used, reason = "a fuzz target reports by a panic")]

use libfuzzer_sys::fuzz_target;
use relight_core::asset::Asset;

fuzz_target!(|bytes: &[u8]| {
    let Ok(asset) = Asset::from_bytes(bytes) else {
        return;
    };
    let written = asset.to_bytes().expect("what was read can be written");
    let read = Asset::from_bytes(&written).expect("what was written can be read");
    assert_eq!(read.name(), asset.name());
    assert_eq!(read.extent(), asset.extent());
});
