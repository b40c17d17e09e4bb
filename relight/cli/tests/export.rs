//! `relight export` from outside: what it refuses leaves everything as it was.
#![expect(
    clippy::unwrap_used,
    reason = "a test fails by a panic, in its helpers too"
)]

use std::fs;
use std::process::Command;

use relight_core::captured_object::CapturedObject;
use relight_core::image::{Planes, Rgb};
use relight_core::light::{Normals, Order, ShLight};
use relight_core::render::Surface;

/// A folder with a captured ball.
struct Desk {
    folder: tempfile::TempDir,
}

impl Desk {
    fn new() -> Self {
        let desk = Self {
            folder: tempfile::tempdir().unwrap(),
        };
        let normals = Normals::sphere(24);
        let alpha = Planes::from_fn(normals.extent(), |x, y| {
            [f32::from(u8::from(normals.planes().pixel(x, y)[2] > 0.0))]
        });
        let albedo = Rgb::new(Planes::filled(normals.extent(), [0.6, 0.3, 0.1]));
        let surface = Surface::new(normals, albedo, None).unwrap();
        let ball = CapturedObject::new("ball", surface, alpha.clone(), alpha).unwrap();
        ball.write(&desk.folder.path().join("ball.relit")).unwrap();
        desk
    }

    /// Runs `relight export` in the folder: the exit code and what stands on standard error.
    fn export(&self, arguments: &str) -> (i32, String) {
        let output = Command::new(env!("CARGO_BIN_EXE_relight"))
            .arg("export")
            .args(arguments.split(' '))
            .current_dir(self.folder.path())
            .output()
            .unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        (output.status.code().unwrap(), said)
    }
}

#[test]
fn a_script_whose_light_cannot_be_read_takes_no_file_away() {
    let desk = Desk::new();
    let own = desk.folder.path().join("scene.glb");
    fs::write(&own, "mine").unwrap();
    let (code, said) = desk.export("ball.relit -o scene.py --light nothing.txt");
    assert_eq!(code, 1, "{said}");
    assert!(said.contains("nothing.txt"), "{said}");
    assert_eq!(fs::read_to_string(&own).unwrap(), "mine");
    assert!(!desk.folder.path().join("scene.py").exists());
    let light = ShLight::even(Order::TWO, [1.0; 3]);
    light.write(&desk.folder.path().join("light.txt")).unwrap();
    let (code, said) = desk.export("ball.relit -o scene.py --light light.txt");
    assert_eq!(code, 0, "{said}");
    for name in ["scene.py", "scene.glb", "scene.light.exr"] {
        assert!(
            fs::metadata(desk.folder.path().join(name)).unwrap().len() > 100,
            "{name}"
        );
    }
}
