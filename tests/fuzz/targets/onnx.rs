//! The signature of an ONNX file.

#![no_main]

use libfuzzer_sys::fuzz_target;
use relight_photo::nets::OnnxSignature;

fuzz_target!(|bytes: &[u8]| {
    let _ = OnnxSignature::read(bytes);
});
