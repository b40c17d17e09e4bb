//! Meshes: bytes that can be read as glTF 2.0, or as Wavefront with materials, are a surface in the unit sphere.

#![no_main]
#![allow(clippy::expect_used, reason = "a fuzz target reports by a panic")]

use std::fs;

use libfuzzer_sys::fuzz_target;
use relight_synth::Mesh;

fuzz_target!(|bytes: &[u8]| {
    // A mesh is read from a file, as it can name others beside it.
    let folder = std::env::temp_dir().join(format!("relit-fuzz-mesh-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder can be made");
    // Read as its own materials, too.
    fs::write(folder.join("a.mtl"), bytes).expect("a file can be written");
    for name in ["a.glb", "a.obj"] {
        let path = folder.join(name);
        fs::write(&path, bytes).expect("a file can be written");
        if let Ok(mesh) = Mesh::read(&path) {
            let farthest = mesh.positions.iter().map(|place| place.length());
            assert!(farthest.fold(0.0, f32::max) < 1.001);
        }
    }
});
