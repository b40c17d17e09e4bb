//! `relight render` from outside: files in, files out, exit codes.
#![expect(
    clippy::unwrap_used,
    reason = "a test fails by a panic, in its helpers too"
)]

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use relight_core::image::{Depth, Rgb, Transfer};
use relight_core::light::{Normals, Order, ShLight};

/// A folder with a ball's normals, y up and y down, and light from above.
struct Scene {
    folder: tempfile::TempDir,
}

impl Scene {
    fn new() -> Self {
        let scene = Self {
            folder: tempfile::tempdir().unwrap(),
        };
        let normals = Normals::sphere(24);
        normals
            .write_png(&scene.path("up.png"), Depth::Sixteen)
            .unwrap();
        let down = normals.flipped();
        down.write_png(&scene.path("down.png"), Depth::Sixteen)
            .unwrap();
        let mut light = ShLight::even(Order::TWO, [1.0; 3]);
        light.coefficients_mut()[1] = [1.5; 3];
        light.write(&scene.path("light.txt")).unwrap();
        scene
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Runs `relight render image` in the folder.
    fn image_of(&self, arguments: &str) -> Output {
        Command::new(env!("CARGO_BIN_EXE_relight"))
            .args(["render", "image"])
            .args(arguments.split(' '))
            .current_dir(self.folder.path())
            .output()
            .unwrap()
    }

    fn image(&self, name: &str) -> Rgb<relight_core::image::Linear> {
        Rgb::read(&self.path(name), Transfer::Srgb).unwrap()
    }
}

fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

fn errors(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

#[test]
fn light_from_above_lights_the_upper_half_whichever_way_y_points_in_the_file() {
    let scene = Scene::new();
    for (map, way) in [("up.png", "up"), ("down.png", "down")] {
        let output = scene.image_of(&format!(
            "--normals {map} --normals-y {way} --light light.txt -o {way}-lit.png"
        ));
        assert_eq!(code(&output), 0, "{}", errors(&output));
        let image = scene.image(&format!("{way}-lit.png"));
        let [above, below] = [3, 20].map(|y| image.planes().pixel(12, y)[0]);
        assert!(above > 1.5 * below, "{way}: {above} {below}");
        assert_eq!(image.planes().pixel(0, 0), [0.0; 3]);
    }
}

#[test]
fn an_exr_holds_light_in_the_exposure_that_was_asked_for() {
    let scene = Scene::new();
    let red = |stops: &str| {
        let output = scene.image_of(&format!(
            "--normals up.png --albedo 1 --light light.txt --exposure {stops} -o lit.exr"
        ));
        assert_eq!(code(&output), 0, "{}", errors(&output));
        scene.image("lit.exr").planes().pixel(12, 2)[0]
    };
    let ratio = red("2") / red("-1");
    assert!((ratio - 8.0).abs() < 1e-4, "{ratio}");
}

#[test]
fn a_still_object_against_the_light_is_exposed_longer_and_a_video_as_for_light_from_all_sides() {
    let scene = Scene::new();
    let exposure = |lamp: &str| {
        let output = scene.image_of(&format!("--normals up.png --lamp {lamp} --json"));
        assert_eq!(code(&output), 0, "{}", errors(&output));
        let event: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        event["exposure"].as_f64().unwrap()
    };
    let [front, behind] = ["0,20 -o front.png", "180,20 -o behind.png"].map(exposure);
    assert!(behind > 1.2 * front, "{behind} {front}");
    if Command::new("ffmpeg").arg("-version").output().is_ok() {
        let rotating = exposure("180,20 --rotate 90 --seconds 0.1 --fps 10 -o film.mp4");
        assert!((rotating / front - 1.0).abs() < 0.02, "{rotating} {front}");
    }
}

#[test]
fn the_light_that_is_saved_gives_the_same_picture() {
    let scene = Scene::new();
    let first = scene.image_of(
        "--normals up.png --light light.txt --light-angle 70 --save-light rotated.txt -o first.png",
    );
    let second = scene.image_of("--normals up.png --light rotated.txt -o second.png");
    assert_eq!((code(&first), code(&second)), (0, 0));
    let [first, second] =
        ["first.png", "second.png"].map(|name| fs::read(scene.path(name)).unwrap());
    assert_eq!(first, second);
}

#[test]
fn a_file_that_is_missing_or_wrong_is_named_in_one_line_and_the_code_is_1() {
    let scene = Scene::new();
    fs::write(scene.path("short.txt"), "1 2 3\n4 5\n").unwrap();
    fs::write(scene.path("taken"), "a file").unwrap();
    let cases = [
        ("--normals none.png --light light.txt -o a.png", "none.png"),
        ("--normals up.png --light short.txt -o a.png", "short.txt"),
        ("--normals up.png --light up.png -o a.png", "up.png"),
        ("--normals up.png --light light.txt -o taken/a.png", "taken"),
    ];
    for (arguments, named) in cases {
        let output = scene.image_of(arguments);
        let errors = errors(&output);
        assert_eq!(code(&output), 1, "{arguments}");
        assert!(errors.contains(named), "{errors}");
        assert_eq!(errors.lines().count(), 1, "{errors}");
    }
    assert!(!scene.path("a.png").exists());
}

#[test]
fn wrong_usage_is_told_with_code_2() {
    let scene = Scene::new();
    for arguments in [
        "--normals up.png -o a.png",
        "--normals up.png --light light.txt --rotate 360 -o a.png",
        "--normals up.png --light light.txt --rotate 360 -o folder",
        "--normals up.png --light light.txt -o folder",
        "--normals up.png --light light.txt --albedo 1,2 -o a.png",
        "--normals up.png --light light.txt --light-angle nan -o a.png",
        "--normals up.png --light light.txt --lamp 1,2 -o a.png",
        "--normals up.png --light light.txt --seconds 3 -o a.png",
        "--normals up.png --light light.txt --rotate 90 -o a.gif",
        "--normals up.png --light light.txt --smoothness 5,6,7 -o a.png",
    ] {
        let output = scene.image_of(arguments);
        assert_eq!(code(&output), 2, "{arguments}: {}", errors(&output));
    }
}

#[test]
fn a_lamp_from_the_right_lights_the_right_half() {
    let scene = Scene::new();
    let output = scene.image_of("--normals up.png --lamp 90,0 -o lit.png");
    assert_eq!(code(&output), 0, "{}", errors(&output));
    let image = scene.image("lit.png");
    let [left, right] = [3, 20].map(|x| image.planes().pixel(x, 12)[0]);
    assert!(right > 1.5 * left, "{left} {right}");
}

#[test]
fn no_input_is_overwritten() {
    let scene = Scene::new();
    let before = fs::read(scene.path("up.png")).unwrap();
    for outputs in ["-o up.png", "-o lit.png --save-light up.png"] {
        let line = format!("--normals up.png --light light.txt {outputs}");
        assert_eq!(code(&scene.image_of(&line)), 1);
    }
    assert_eq!(fs::read(scene.path("up.png")).unwrap(), before);
    assert!(!scene.path("lit.png").exists());
}
