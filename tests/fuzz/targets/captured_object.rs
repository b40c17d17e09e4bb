//! `object.relit`: bytes that can be read as a captured object are the same object after writing and reading them again.

#![no_main]
#![allow(clippy::expect_used, reason = "a fuzz target reports by a panic")]

use libfuzzer_sys::fuzz_target;
use relight_core::captured_object::CapturedObject;

fuzz_target!(|bytes: &[u8]| {
    let Ok(object) = CapturedObject::from_bytes(bytes) else {
        return;
    };
    let written = object.to_bytes().expect("what was read can be written");
    let read = CapturedObject::from_bytes(&written).expect("what was written can be read");
    assert_eq!(read.name(), object.name());
    assert_eq!(read.extent(), object.extent());
});
