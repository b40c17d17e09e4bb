//! ONNX files whose weights stand in other files: bytes that such weights can be put into need no other file any more.

#![no_main]
#![allow(clippy::expect_used, reason = "a fuzz target reports by a panic")]

use libfuzzer_sys::fuzz_target;
use relight_photo::nets::{ExternalPart, OnnxSignature, with_external_weights};

/// Longest part of another file that is made up, bytes.
const MAX_LENGTH: u64 = 1 << 16;

fuzz_target!(|bytes: &[u8]| {
    let _ = OnnxSignature::read(bytes);
    let made_up = |part: &ExternalPart| match part.length {
        0..=MAX_LENGTH => Ok(vec![1; part.length as usize]),
        _ => Err(String::new()),
    };
    if let Ok(Some(whole)) = with_external_weights(bytes, made_up) {
        let again = with_external_weights(&whole, |_| Err(String::new()));
        assert!(again.expect("what was put together can be read").is_none());
    }
});
