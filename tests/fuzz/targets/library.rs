//! Packed libraries: bytes that can be read as one hold surfaces in the unit sphere, and panoramas that are light.

#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use relight_synth::Library;

fuzz_target!(|bytes: &[u8]| {
    let Ok(library) = Library::from_bytes(Path::new("fuzz.relib"), bytes) else {
        return;
    };
    for (_, mesh) in &library.meshes {
        let farthest = mesh.positions.iter().map(|place| place.length());
        assert!(farthest.fold(0.0, f32::max) < 1.001);
    }
    let _ = library.validation();
});
