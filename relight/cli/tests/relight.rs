//! `relight relight` and `relight insert` from outside: what it writes, and what it refuses. The network is not trained.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::fs::{self, File};
use std::path::PathBuf;
use std::process::{Command, Output};

use image::{GrayImage, Luma, Rgb, RgbImage};
use relight_core::captured_object::CapturedObject;
use relight_core::files::{read_planes, write_exr};
use relight_core::image::{ColourSpace, Extent, Planes, Rgb as Picture, Srgb};
use relight_core::light::{Normals, Order, Panorama, ShLight};
use relight_core::render::Surface;
use relight_photo::nets::{WeightPrecision, Weights, decomposer};

const WIDTH: u32 = 64;
const HEIGHT: u32 = 48;

fn is_inside(x: u32, y: u32) -> bool {
    (f64::from(x) - 32.0).hypot(f64::from(y) - 24.0) < 18.0
}

fn photo() -> RgbImage {
    RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
        if is_inside(x, y) {
            Rgb([110 + x as u8, 100, 60 + 2 * y as u8])
        } else {
            Rgb([70, 120, 200])
        }
    })
}

struct Folder(tempfile::TempDir);

impl Folder {
    /// Two photographs, a folder of their masks, a panorama, and weights.
    fn new() -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        for name in ["photos", "masks"] {
            fs::create_dir(folder.path(name)).unwrap();
        }
        let mask = GrayImage::from_fn(WIDTH, HEIGHT, |x, y| {
            Luma([if is_inside(x, y) { 255 } else { 0 }])
        });
        for name in ["one", "two"] {
            photo()
                .save(folder.path(&format!("photos/{name}.png")))
                .unwrap();
            mask.save(folder.path(&format!("masks/{name}.png")))
                .unwrap();
        }
        let light = ShLight::even(Order::TWO, [0.5, 1.0, 2.0]);
        let panorama = Panorama::from_light(&light, Extent::new(32, 16));
        panorama.image().write_exr(&folder.path("sky.exr")).unwrap();
        let weights = Weights::initial(&decomposer(), 3);
        weights
            .write(&folder.path("w.safetensors"), WeightPrecision::Half)
            .unwrap();
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn run(&self, arguments: &str) -> Output {
        Command::new(env!("CARGO_BIN_EXE_relight"))
            .args(arguments.split(' '))
            .current_dir(self.0.path())
            .output()
            .unwrap()
    }

    /// Exit code and what was written on standard error.
    fn code_and_errors(&self, arguments: &str) -> (i32, String) {
        let output = self.run(arguments);
        let errors = String::from_utf8(output.stderr).unwrap();
        (output.status.code().unwrap(), errors)
    }

    fn names_in(&self, name: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(name)).unwrap();
        let mut names: Vec<String> = entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }
}

#[test]
fn photographs_of_a_folder_are_relit_before_the_panorama_and_what_has_no_mask_is_named() {
    let folder = Folder::new();
    photo().save(folder.path("photos/three.png")).unwrap();
    let (code, errors) = folder.code_and_errors(
        "relight photos --mask masks --light sky.exr --weights w.safetensors -o out",
    );
    assert_eq!(code, 3, "{errors}");
    assert!(errors.contains("photos/three.png"), "{errors}");
    assert_eq!(folder.names_in("out"), ["one.png", "two.png"]);
    let (relit, _) = read_planes(&folder.path("out/one.png")).unwrap();
    assert_eq!(relit.extent(), Extent::new(WIDTH as usize, HEIGHT as usize));
    // The sky instead of the photograph's background, and the object in that light.
    assert!((relit.pixel(2, 2)[2] - 200.0 / 255.0).abs() > 1e-3);
    let own = f32::from(photo().get_pixel(32, 24).0[2]) / 255.0;
    assert!(relit.pixel(32, 24)[2] > own);
}

#[test]
fn the_photograph_s_own_light_gives_the_photograph_back_and_exr_is_linear() {
    let folder = Folder::new();
    let command = "relight photos/one.png --mask masks/one.png --light own --weights w.safetensors";
    let (code, errors) = folder.code_and_errors(&format!("{command} -o same.png"));
    assert_eq!((code, errors.as_str()), (0, ""));
    let same = image::open(folder.path("same.png")).unwrap().into_rgb8();
    for (a, b) in same.pixels().zip(photo().pixels()) {
        assert!((0..3).all(|c| a.0[c].abs_diff(b.0[c]) <= 1), "{a:?} {b:?}");
    }
    assert_eq!(
        folder
            .code_and_errors(&format!("{command} --exposure 1 -o twice.exr"))
            .0,
        0
    );
    let (twice, _) = read_planes(&folder.path("twice.exr")).unwrap();
    let sky = Srgb::to_linear(200.0 / 255.0);
    assert!((twice.pixel(0, 0)[2] - sky).abs() < 1e-4);
}

#[test]
fn what_is_wrong_is_told_in_a_sentence_and_nothing_is_written() {
    let folder = Folder::new();
    GrayImage::new(WIDTH, HEIGHT)
        .save(folder.path("empty.png"))
        .unwrap();
    GrayImage::new(9, 9).save(folder.path("small.png")).unwrap();
    let extent = Extent::new(WIDTH as usize, HEIGHT as usize);
    let odd = Planes::from_fn(extent, |x, _| [if x == 5 { f32::NAN } else { 0.5 }; 3]);
    write_exr(&folder.path("odd.exr"), &odd).unwrap();
    let sky = Planes::from_fn(Extent::new(32, 16), |x, _| {
        [if x == 5 { f32::NAN } else { 0.5 }; 3]
    });
    write_exr(&folder.path("odd-sky.exr"), &sky).unwrap();
    let black = Panorama::from_light(&ShLight::dark(Order::TWO), Extent::new(32, 16));
    black.image().write_exr(&folder.path("black.exr")).unwrap();
    fs::write(folder.path("text.txt"), "1 2 3\n1 2\n").unwrap();
    huge(&folder.path("huge.png"));
    let one = "relight photos/one.png";
    let dark = "the light is completely dark";
    for (command, code, named) in [
        (format!("{one} --lamp 30,40 -o o.png"), 1, "photos/one.png"),
        (
            format!("{one} --mask empty.png --lamp 30,40 -o o.png"),
            1,
            "empty.png",
        ),
        (
            format!("{one} --mask small.png --lamp 30,40 -o o.png"),
            1,
            "9 x 9",
        ),
        (
            format!("{one} --mask masks/one.png --light photos/two.png -o o.png"),
            1,
            "EXR",
        ),
        (
            format!("{one} --mask masks/one.png --light odd.exr -o o.png"),
            1,
            "odd.exr",
        ),
        (
            format!("{one} --mask masks/one.png --light odd-sky.exr -o o.png"),
            1,
            "odd-sky.exr",
        ),
        (
            format!(
                "{one} --mask masks/one.png --light black.exr --weights w.safetensors -o o.png"
            ),
            1,
            dark,
        ),
        (
            format!("{one} --mask masks/one.png --light text.txt -o o.png"),
            1,
            "line 2",
        ),
        (
            "relight huge.png --mask masks/one.png --lamp 0,0 -o o.png".to_owned(),
            1,
            "20000 x 20000",
        ),
        (
            "relight none.png --lamp 0,0 -o o.png".to_owned(),
            1,
            "none.png",
        ),
        (format!("{one} -o o.png"), 2, "--lamp AZIMUTH,ELEVATION"),
        (format!("{one} --lamp 400,120 -o o.png"), 2, "90"),
        (
            "relight photos/one.png photos/two.png --lamp 30,40 -o o.png".to_owned(),
            2,
            "o.png",
        ),
        (format!("{one} --lamp 30 -o o.png"), 2, "AZIMUTH,ELEVATION"),
        (format!("{one} --lamp 30,40 -o o.mp4"), 2, ".exr"),
        (
            format!("{one} --lamp 30,40 --rotate 360 -o o.png"),
            2,
            ".webm",
        ),
        (format!("{one} --lamp 30,40 -o o.bmp"), 2, ".exr"),
        (
            format!("{one} --lamp 30,40 --background light -o o.png"),
            2,
            "--background",
        ),
        (
            format!("{one} --light own --background light -o o.png"),
            2,
            "needs a panorama",
        ),
        (
            format!("{one} --light text.txt --background light -o o.png"),
            2,
            "needs a panorama",
        ),
        (
            "relight photos/one.png photos/two.png --mask masks/one.png --lamp 30,40 -o o"
                .to_owned(),
            2,
            "masks/one.png",
        ),
        (
            format!("{one} --light own --lamp 30,40 -o o.png"),
            2,
            "--lamp",
        ),
    ] {
        let (found, errors) = folder.code_and_errors(&command);
        assert_eq!(found, code, "{command}: {errors}");
        assert!(errors.contains(named), "{command}: {errors}");
    }
    for name in ["o.png", "o.mp4", "o.bmp", "o"] {
        assert!(!folder.path(name).exists(), "{name}");
    }
}

#[test]
fn no_file_that_is_read_is_overwritten() {
    let folder = Folder::new();
    let files = [
        "photos/one.png",
        "masks/one.png",
        "photos/two.png",
        "sky.exr",
    ];
    let before = files.map(|name| fs::read(folder.path(name)).unwrap());
    let given =
        "relight photos/one.png --mask masks/one.png --weights w.safetensors --light sky.exr";
    let inserted = "insert photos/one.png --mask masks/one.png --weights w.safetensors --into";
    for command in [
        format!("{given} -o photos/one.png"),
        format!("{given} -o ./masks/one.png"),
        format!("{given} -o sky.exr"),
        "relight photos --mask masks --weights w.safetensors --lamp 30,40 -o masks".to_owned(),
        format!("{inserted} photos/two.png -o photos/two.png"),
        format!("{inserted} sky.exr -o masks/one.png"),
    ] {
        let (code, errors) = folder.code_and_errors(&command);
        assert_eq!(code, 1, "{command}: {errors}");
        assert!(
            errors.contains(command.rsplit(' ').next().unwrap()),
            "{command}: {errors}"
        );
        let after = files.map(|name| fs::read(folder.path(name)).unwrap());
        assert!(before == after, "{command}");
    }
    assert!(!folder.path("o.png").exists());
}

/// On a full disk, ffmpeg says so and ends without an error.
#[cfg(unix)]
#[test]
fn a_video_of_which_ffmpeg_says_that_it_failed_is_not_left() {
    use std::os::unix::fs::PermissionsExt;

    let folder = Folder::new();
    fs::create_dir(folder.path("bin")).unwrap();
    let script = "#!/bin/sh\ncat > /dev/null\nfor last; do :; done\necho part > \"${last#file:}\"\n\
                  echo 'Error writing trailer: No space left on device' >&2\n";
    fs::write(folder.path("bin/ffmpeg"), script).unwrap();
    fs::set_permissions(folder.path("bin/ffmpeg"), fs::Permissions::from_mode(0o755)).unwrap();
    let path = format!(
        "{}:{}",
        folder.path("bin").display(),
        std::env::var("PATH").unwrap()
    );
    let command = "relight photos/one.png --mask masks/one.png --weights w.safetensors \
                   --lamp 30,40 --rotate 90 --seconds 0.1 -o turn.mp4";
    let output = Command::new(env!("CARGO_BIN_EXE_relight"))
        .args(command.split_whitespace())
        .env("PATH", path)
        .current_dir(folder.0.path())
        .output()
        .unwrap();
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{errors}");
    assert!(errors.contains("No space left on device"), "{errors}");
    let names = folder.names_in(".");
    assert!(!names.iter().any(|name| name.contains("turn")), "{names:?}");
}

/// A PNG that says it has 20 000 x 20 000 pixels, and holds none.
fn huge(path: &std::path::Path) {
    let mut encoder = png::Encoder::new(File::create(path).unwrap(), 20_000, 20_000);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().unwrap();
    writer
        .write_chunk(png::chunk::IDAT, &[0x78, 0x9c, 0x03, 0x00])
        .unwrap();
}

#[test]
fn a_rotation_of_the_light_is_a_video_of_as_many_frames() {
    if Command::new("ffmpeg").arg("-version").output().is_err() {
        relit_test_support::say_skipped("the program ffmpeg is not installed");
        return;
    }
    let folder = Folder::new();
    let command = "relight photos/one.png --mask masks/one.png --light sky.exr --rotate 360 --seconds 0.5 --fps 12 \
                   --size 32 --weights w.safetensors --json -o turn.mp4";
    let output = folder.run(&command.split_whitespace().collect::<Vec<_>>().join(" "));
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert_eq!(relit_event(&output.stdout)["frames"], 6);
    let probed = Command::new("ffprobe")
        .args([
            "-v",
            "error",
            "-count_frames",
            "-of",
            "csv=p=0",
            "-show_entries",
            "stream=width,height,nb_read_frames",
        ])
        .arg(folder.path("turn.mp4"))
        .output()
        .unwrap();
    assert_eq!(String::from_utf8_lossy(&probed.stdout).trim(), "32,24,6");
}

#[test]
fn objects_are_inserted_from_back_to_front_by_options_and_by_a_scene_file() {
    let folder = Folder::new();
    let scene = |head: &str| {
        let object = |name: &str, at: f64| {
            format!(
                "[[object]]\nphoto = \"photos/{name}.png\"\nmask = \"masks/{name}.png\"\nat = [{at}, 0.9]\nheight = 0.5\n"
            )
        };
        let text = format!("{head}\n{}{}", object("one", 0.3), object("two", 0.7));
        fs::write(folder.path("scene.toml"), text).unwrap();
        "--scene scene.toml"
    };
    let picture = |what: &str| {
        let command = format!("insert {what} --weights w.safetensors -o o.png");
        let (code, warnings) = folder.code_and_errors(&command);
        // The panorama has a pixel for eleven degrees.
        let is_panorama = fs::read_to_string(folder.path("scene.toml"))
            .is_ok_and(|scene| what.contains("scene") && scene.contains("sky.exr"));
        assert_eq!(code, 0, "{warnings}");
        assert_eq!(warnings.contains("sky.exr"), is_panorama, "{warnings}");
        read_planes(&folder.path("o.png")).unwrap().0
    };
    let by_options = picture(
        "photos/one.png photos/two.png --mask masks --into photos/two.png --at 0.3,0.9 --at 0.7,0.9 --height 0.5",
    );
    assert_eq!(
        by_options,
        picture(scene("background = \"photos/two.png\""))
    );
    let seen = picture(scene("background = \"sky.exr\"\nsize = [96, 64]"));
    assert_eq!(seen.extent(), Extent::new(96, 64));
    // The sky is blue, what stands before it is not as blue.
    assert!(seen.pixel(2, 2)[2] > 1.3 * seen.pixel(2, 2)[0]);
    assert_ne!(seen.pixel(29, 44), seen.pixel(2, 44));
}

#[test]
fn a_webp_becomes_a_jpeg_in_a_folder_that_is_made_and_half_a_file_is_refused() {
    let folder = Folder::new();
    photo().save(folder.path("photos/one.webp")).unwrap();
    let insert = "--mask masks/one.png --into photos/two.png --weights w.safetensors -o";
    let command = format!("insert photos/one.webp {insert} new/deep/one.jpg");
    assert_eq!(folder.code_and_errors(&command), (0, String::new()));
    let command = format!("insert photos/one.png {insert} new/one.png");
    assert_eq!(folder.code_and_errors(&command).0, 0);
    let read = |name: &str| read_planes(&folder.path(name)).unwrap().0;
    let (jpeg, png) = (read("new/deep/one.jpg"), read("new/one.png"));
    let pairs = jpeg.plane(1).iter().zip(png.plane(1));
    let apart = pairs.map(|(a, b)| (a - b).abs()).sum::<f32>() / jpeg.plane(1).len() as f32;
    assert!(apart < 0.02, "{apart}");

    let whole = fs::read(folder.path("new/deep/one.jpg")).unwrap();
    fs::write(folder.path("half.jpg"), &whole[..whole.len() / 2]).unwrap();
    let relit =
        "relight half.jpg --mask masks/one.png --lamp 10,20 --weights w.safetensors -o o.png";
    let (code, errors) = folder.code_and_errors(relit);
    assert!(code == 1 && errors.contains("half.jpg"), "{errors}");
    assert!(!folder.path("o.png").exists());
}

#[test]
fn linear_photographs_are_inserted_as_such_and_a_warm_lamp_may_be_balanced() {
    let folder = Folder::new();
    let picture = |scene: &str, object: &str| {
        let scene = format!(
            "background = \"photos/two.png\"\nlight.lamp = \"20,40,2700K\"\n{scene}\n[[object]]\n\
             photo = \"photos/one.png\"\nmask = \"masks/one.png\"\nheight = 0.7\n{object}\n"
        );
        fs::write(folder.path("scene.toml"), scene).unwrap();
        let command = "insert --scene scene.toml --weights w.safetensors -o o.png";
        assert_eq!(folder.code_and_errors(command), (0, String::new()));
        read_planes(&folder.path("o.png")).unwrap().0.pixel(32, 26)
    };
    let warm = picture("white_balance = \"light\"", "");
    let balanced = picture("white_balance = \"auto\"", "");
    assert!(
        warm[0] / warm[2] > 1.2 * balanced[0] / balanced[2],
        "{warm:?} {balanced:?}"
    );
    let linear = picture("white_balance = \"light\"", "transfer = \"linear\"");
    assert_ne!(linear, warm);
}

#[test]
fn a_captured_object_is_inserted_beside_photographs_and_needs_no_mask() {
    let folder = Folder::new();
    let normals = Normals::sphere(40);
    let full = Planes::filled(normals.extent(), [1.0]);
    let albedo = Picture::new(Planes::filled(normals.extent(), [0.7, 0.1, 0.1]));
    let surface = Surface::new(normals, albedo, None).unwrap();
    let asset = CapturedObject::new("red", surface, full.clone(), full).unwrap();
    asset.write(&folder.path("red.relit")).unwrap();
    let common = "--into sky.exr --height 0.5 --weights w.safetensors -o";
    let command = format!("insert photos/one.png red.relit --mask masks {common} both.png");
    assert_eq!(folder.code_and_errors(&command).0, 0);
    let (picture, _) = read_planes(&folder.path("both.png")).unwrap();
    let red = picture.pixel(960, 630);
    // In light as blue as this, paper would be blue.
    assert!(red[0] > red[2], "{red:?}");

    let command = format!("insert red.relit --mask masks/one.png {common} none.png");
    let (code, errors) = folder.code_and_errors(&command);
    assert!(code == 1 && errors.contains("red.relit"), "{errors}");
    fs::write(folder.path("red.relit"), b"PK").unwrap();
    let (code, errors) = folder.code_and_errors(&format!("insert red.relit {common} none.png"));
    assert!(code == 1 && errors.contains("red.relit"), "{errors}");
    assert!(!folder.path("none.png").exists());
}

#[test]
fn a_scene_that_cannot_be_is_told_in_a_sentence_and_nothing_is_written() {
    let folder = Folder::new();
    fs::write(
        folder.path("odd.toml"),
        "background = \"sky.exr\"\nhight = 3\n",
    )
    .unwrap();
    fs::write(folder.path("none.toml"), "background = \"none.exr\"\n[[object]]\nphoto = \"photos/one.png\"\nmask = \"masks/one.png\"\n").unwrap();
    let one = "insert photos/one.png --mask masks/one.png";
    for (command, code, named) in [
        ("insert --scene odd.toml -o o.png".to_owned(), 1, "`hight`"),
        (
            "insert --scene none.toml -o o.png".to_owned(),
            1,
            "none.exr",
        ),
        (
            "insert --scene missing.toml -o o.png".to_owned(),
            1,
            "missing.toml",
        ),
        (
            format!("{one} --into sky.exr --height 9 -o o.png"),
            1,
            "object 1: height",
        ),
        (
            format!("{one} --into sky.exr --at 1.5,0.9 --height 0.3 -o o.png"),
            1,
            "object 1",
        ),
        (
            format!("{one} --into sky.exr --lamp 5 -o o.png"),
            2,
            "AZIMUTH,ELEVATION",
        ),
        (
            "insert --scene odd.toml --lamp 5,6 -o o.png".to_owned(),
            2,
            "--scene",
        ),
        (format!("{one} --into sky.exr -o o.mp4"), 1, "--rotate"),
        (format!("{one} --into photos/two.png -o o.mp4"), 1, "o.mp4"),
        (format!("{one} --into sky.exr -o o.mp4"), 1, "o.mp4"),
        (
            format!("{one} --into sky.exr --at 0.1,0.2 --at 0.3,0.4 -o o.png"),
            2,
            "--at",
        ),
        (
            "insert photos/one.png photos/two.png --mask masks/one.png --into sky.exr -o o.png"
                .to_owned(),
            2,
            "--mask",
        ),
        (format!("{one} --into sky.exr -o o.bmp"), 2, ".webm"),
        (
            format!("{one} --into sky.exr --light own -o o.png"),
            2,
            "--light own",
        ),
    ] {
        let (found, errors) = folder.code_and_errors(&command);
        assert_eq!(found, code, "{command}: {errors}");
        assert!(errors.contains(named), "{command}: {errors}");
    }
    for name in ["o.png", "o.jpg", "o.mp4", "o.bmp"] {
        assert!(!folder.path(name).exists(), "{name}");
    }
}

#[test]
fn float_photographs_are_made_usable_by_every_verb_with_warnings_in_the_same_words() {
    let folder = Folder::new();
    let extent = Extent::new(WIDTH as usize, HEIGHT as usize);
    let odd = Planes::from_fn(extent, |x, y| {
        let levels = photo().get_pixel(x as u32, y as u32).0;
        let light = levels.map(|level| 1000.0 * Srgb::to_linear(f32::from(level) / 255.0));
        if (x, y) == (5, 0) {
            [f32::NAN, -1.0, 300.0]
        } else {
            light
        }
    });
    write_exr(&folder.path("odd.exr"), &odd).unwrap();
    let common = "--weights w.safetensors --json -o";
    let warnings = |command: &str| {
        let output = folder.run(command);
        assert_eq!(output.status.code(), Some(0), "{command}");
        let events = serde_json::Deserializer::from_slice(&output.stdout).into_iter();
        let events = events.map(|event: Result<serde_json::Value, _>| event.unwrap());
        let warnings = events.filter(|event| event["event"] == "warning");
        let messages = warnings.map(|event| event["message"].as_str().unwrap().to_owned());
        messages.collect::<Vec<_>>()
    };
    let decomposed = warnings(&format!(
        "decompose odd.exr --mask masks/one.png {common} out"
    ));
    assert_eq!(decomposed.len(), 2, "{decomposed:?}");
    assert!(decomposed.iter().all(|warning| warning.contains("odd.exr")));
    for command in [
        format!("relight odd.exr --mask masks/one.png --light own {common} same.exr"),
        format!("insert odd.exr --mask masks/one.png --into photos/two.png {common} o.png"),
        format!("insert photos/one.png --mask masks/one.png --into odd.exr {common} behind.exr"),
    ] {
        assert_eq!(warnings(&command), decomposed, "{command}");
    }
    // What is written has the units of the scaled photograph.
    let json = fs::read(folder.path("out/decomposition.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    let scale = json["scale"].as_f64().unwrap() as f32;
    for name in ["same.exr", "behind.exr"] {
        let found = read_planes(&folder.path(name)).unwrap().0.pixel(2, 2)[2];
        assert!(
            (found / (scale * odd.pixel(2, 2)[2]) - 1.0).abs() < 0.05,
            "{name}: {found}"
        );
    }
}

#[test]
fn a_decomposition_s_folder_is_an_object_and_a_rectangle_shows_one() {
    let folder = Folder::new();
    let common = "--weights w.safetensors -o";
    let rect = "--rect 12,4,40,40";
    let command = format!("decompose photos/one.png {rect} {common} cut");
    assert_eq!(folder.code_and_errors(&command).0, 0);
    let (mask, _) = read_planes(&folder.path("cut/mask.png")).unwrap();
    let [inside, corner] = [(32, 24), (13, 5)].map(|(x, y)| mask.pixel(x, y)[0]);
    assert_eq!([inside, corner], [1.0, 0.0]);
    let command = format!("insert photos/one.png {rect} --into photos/two.png {common} o.png");
    assert_eq!(folder.code_and_errors(&command).0, 0);

    let command = "render image cut --lamp 30,40 -o lit.png";
    assert_eq!(folder.code_and_errors(command), (0, String::new()));
    let (lit, _) = read_planes(&folder.path("lit.png")).unwrap();
    assert!(lit.pixel(32, 24)[0] > 0.2 && lit.pixel(13, 5) == [0.0; 3]);
    let command = format!("insert cut --into photos/two.png {common} folder.png");
    assert_eq!(folder.code_and_errors(&command).0, 0);
    let albedo = fs::read(folder.path("cut/albedo.png")).unwrap();
    let command = format!("insert cut --into photos/two.png {common} cut/albedo.png");
    let (code, errors) = folder.code_and_errors(&command);
    assert!(code == 1 && errors.contains("cut/albedo.png"), "{errors}");
    assert_eq!(fs::read(folder.path("cut/albedo.png")).unwrap(), albedo);
    let command = format!("insert cut {rect} --into photos/two.png {common} none.png");
    let (code, errors) = folder.code_and_errors(&command);
    assert!(code == 1 && errors.contains("cut"), "{errors}");
    assert!(!folder.path("none.png").exists());
}

/// What a run says of the photograph that it has relit.
fn relit_event(lines: &[u8]) -> serde_json::Value {
    let events = serde_json::Deserializer::from_slice(lines).into_iter();
    let is_relit = |event: &serde_json::Value| event["event"] == "relit";
    let mut events = events.map_while(Result::ok);
    events.find(is_relit).unwrap()
}
