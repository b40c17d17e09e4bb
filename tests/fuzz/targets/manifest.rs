//! `session.json`: a manifest that is read can be written, and is read back equal; what is
//! written of it is written the same the second time. Its name and its video's are safe to join to
//! a folder.

#![no_main]
#![allow(clippy::expect_used, reason = "a panic is how a target tells")]

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
