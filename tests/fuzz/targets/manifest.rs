//! `session.json`: a manifest that can be read is unchanged after writing and reading it again, and
//! is written the same a second time. Its id and its video's file name are safe to join to a path.

#![no_main]
#![allow(clippy::expect_used, reason = "a fuzz target reports by a panic")]

mod completed;

use std::path::{Component, Path};

use libfuzzer_sys::fuzz_target;
use relit_data::session::{Manifest, is_session_name};

/// A whole manifest.
const WHOLE: &[u8] = include_bytes!("../seeds/manifest/complete.json");

fuzz_target!(|bytes: &[u8]| {
    check(bytes);
    if let Some(bytes) = completed::completed(bytes, WHOLE) {
        check(&bytes);
    }
});

fn check(bytes: &[u8]) {
    let Ok(manifest) = Manifest::from_json(bytes) else {
        return;
    };
    assert!(is_session_name(&manifest.id));
    assert!(is_plain(&manifest.id) && is_plain(&manifest.video.file));
    assert!(!manifest.object.trim().is_empty());

    let written = manifest.to_json().expect("what was read can be written");
    let read = Manifest::from_json(&written).expect("what was written can be read");
    assert_eq!(read, manifest);
    assert_eq!(read.to_json().ok(), Some(written));
}

fn is_plain(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    matches!(parts.next(), Some(Component::Normal(part)) if part == name) && parts.next().is_none()
}
