//! The program `relit-extract` and what people give it: names that some file systems take for one, folders as they come
//! from cameras, and masks of other programs.

use std::fs;
use std::path::{Path, PathBuf};

use image::{GrayImage, Luma, Rgba, RgbaImage};
use relit_data::shard::Dataset;
use relit_test_support::{ffmpeg, is_named, turning};

use super::support::Place;

const OBJECT_PX: u64 = 24 * 30;

fn is_inside(x: u32, y: u32) -> bool {
    (20..44).contains(&x) && (10..40).contains(&y)
}

/// A folder with a mask and videos that differ.
struct Inputs(Place);

impl Inputs {
    fn new() -> Self {
        let inputs = Self(Place::new());
        let mask = |x, y| Luma([if is_inside(x, y) { 255 } else { 0 }]);
        GrayImage::from_fn(64, 48, mask)
            .save(inputs.path("mask.png"))
            .unwrap();
        inputs
    }

    fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.0.path(name)
    }

    /// A video whose colours have this hue.
    fn video(&self, name: &str, hue: u32, encoding: &str) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        let object = "between(X,20,43)*between(Y,10,39)";
        let source = turning([64, 48], 10, 8, hue, object);
        let made = format!("made.{}", path.extension().unwrap().to_str().unwrap());
        let mut arguments = vec!["-f", "lavfi", "-i", &source];
        arguments.extend(encoding.split_whitespace());
        arguments.push(&made);
        ffmpeg(self.0.folder(), &arguments);
        fs::rename(self.path(&made), path).unwrap();
    }

    /// The exit code, and what was written to standard error.
    fn extract(&self, arguments: &[&str]) -> (Option<i32>, String) {
        let output = self
            .0
            .command()
            .args(arguments)
            .args(["--frames", "4", "--size", "16", "--align=off"])
            .output()
            .unwrap();
        let errors = String::from_utf8(output.stderr).unwrap();
        (output.status.code(), errors)
    }

    #[track_caller]
    fn assert_sound(&self, sessions: &[&str]) {
        let dataset = Dataset::read(&self.path("out")).unwrap();
        let ids: Vec<&str> = dataset
            .sessions
            .iter()
            .map(|session| session.id.as_str())
            .collect();
        assert_eq!(ids, sessions);
        let report = relit_data::shard::verify(&self.path("out"), &|_, _| {}).unwrap();
        assert_eq!(report.problems, []);
    }

    fn mask_px(&self) -> u64 {
        Dataset::read(&self.path("out")).unwrap().sessions[0]
            .mask
            .px
    }
}

const MJPEG: &str = "-pix_fmt yuvj422p -c:v mjpeg";

/// Names that are one file on some file system, the second of which is refused.
const ALIKE: [(&str, &str, &str); 4] = [
    ("one/Mug.mkv", "two/mug.mkv", "Mug"),
    ("one/caf\u{e9}.mkv", "two/CAFE\u{301}.mkv", "caf\u{e9}"),
    ("one/Stra\u{df}e.mkv", "two/STRASSE.mkv", "Stra\u{df}e"),
    ("one/mug_.mkv", "two/MUG..mkv", "mug_"),
];

#[test]
fn of_two_names_that_are_one_where_case_is_ignored_the_first_is_kept() {
    for (first, second, id) in ALIKE {
        let inputs = Inputs::new();
        inputs.video(first, 0, MJPEG);
        inputs.video(second, 90, MJPEG);
        let (code, errors) = inputs.extract(&[first, second, "--mask", "mask.png", "-o", "out"]);
        assert_eq!(code, Some(3), "{first}: {errors}");
        inputs.assert_sound(&[id]);
        let shard = fs::read(inputs.path(format!("out/{id}.tar"))).unwrap();
        for more in ["--resume", "--replace"] {
            let (code, errors) = inputs.extract(&[second, "--mask", "mask.png", "-o", "out", more]);
            assert_eq!(code, Some(1), "{second} {more}: {errors}");
            inputs.assert_sound(&[id]);
        }
        assert!(fs::read(inputs.path(format!("out/{id}.tar"))).unwrap() == shard);
    }
}

#[test]
fn of_two_names_alike_in_different_tasks_the_first_is_kept() {
    let inputs = Inputs::new();
    inputs.video("one/Mug.mkv", 0, MJPEG);
    inputs.video("two/mug.mkv", 90, MJPEG);
    let task = |task| {
        let both = [
            "one/Mug.mkv",
            "two/mug.mkv",
            "--mask",
            "mask.png",
            "-o",
            "out",
        ];
        inputs.extract(&[&both[..], &["--task", task]].concat())
    };
    // The second first: whoever comes first, it is the same that is refused.
    let (code, errors) = task("1/2");
    assert_eq!(code, Some(1), "{errors}");
    let (code, errors) = task("0/2");
    assert_eq!(code, Some(0), "{errors}");
    assert!(inputs.path("out/Mug.tar").is_file());
    assert!(!inputs.path("out/mug.tar").is_file());
}

#[test]
fn names_that_other_systems_do_not_take_become_names_that_all_take() {
    for (file, id) in [
        ("CON.mkv", "_CON"),
        ("cup%d.mkv", "cup_d"),
        ("http:x.mkv", "http_x"),
        ("what?*[0].mkv", "what___0_"),
        ("mug..mkv", "mug_"),
    ] {
        let inputs = Inputs::new();
        inputs.video(file, 0, MJPEG);
        let (code, errors) = inputs.extract(&[file, "--mask", "mask.png", "-o", "out"]);
        assert_eq!(code, Some(0), "{file}: {errors}");
        inputs.assert_sound(&[id]);
    }
}

#[test]
fn a_name_that_begins_with_a_hyphen_is_a_file_after_two_hyphens_or_with_its_folder() {
    let inputs = Inputs::new();
    inputs.video("-x.mkv", 0, MJPEG);
    for (name, before) in [("./-x.mkv", None), ("-x.mkv", Some("--"))] {
        let mut arguments = vec!["--mask", "mask.png", "-o", "out", "--frames", "4"];
        arguments.extend(["--size", "16", "--align=off", "--replace"]);
        arguments.extend(before);
        arguments.push(name);
        let output = inputs.0.command().args(arguments).output().unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{name}: {errors}");
        inputs.assert_sound(&["-x"]);
    }
}

#[test]
fn the_video_of_a_folder_is_found_by_any_usual_extension_among_what_others_left_there() {
    for (name, encoding) in [
        ("clip.MTS", "-c:v libx264 -pix_fmt yuv420p -f mpegts"),
        ("clip.m2ts", "-c:v libx264 -pix_fmt yuv420p -f mpegts"),
        ("clip.ts", "-c:v mpeg2video -f mpegts -r 25"),
        ("clip.MPG", "-c:v mpeg2video -f mpeg -r 25"),
        ("clip.3gp", "-c:v mpeg4 -f 3gp"),
        ("clip.WMV", "-c:v wmv2 -f asf"),
        ("clip.flv", "-c:v flv -f flv"),
        ("clip.MJPEG", "-c:v mjpeg -pix_fmt yuvj420p -f mjpeg"),
    ] {
        let inputs = Inputs::new();
        inputs.video(&format!("session/{name}"), 0, encoding);
        fs::copy(inputs.path("mask.png"), inputs.path("session/mask.png")).unwrap();
        // AppleDouble files have the name of the file that they belong to.
        for left in [
            format!("._{name}"),
            ".DS_Store".to_owned(),
            "Thumbs.db".to_owned(),
        ] {
            fs::write(inputs.path(format!("session/{left}")), "\0\x05\x16\x07").unwrap();
        }
        let (code, errors) = inputs.extract(&["session", "-o", "out"]);
        assert_eq!(code, Some(0), "{name}: {errors}");
        inputs.assert_sound(&["session"]);
    }
}

#[test]
fn each_video_of_a_folder_of_several_is_a_recording() {
    let inputs = Inputs::new();
    inputs.video("session/a.MTS", 0, "-c:v libx264 -f mpegts");
    inputs.video("session/b.mp4", 0, "-c:v libx264 -pix_fmt yuv420p");
    let (code, errors) = inputs.extract(&["session", "--mask", "mask.png", "-o", "out"]);
    assert_eq!(code, Some(0), "{errors}");
    inputs.assert_sound(&["a", "b"]);
}

#[test]
fn hidden_folders_beside_sessions_end_no_run() {
    let inputs = Inputs::new();
    inputs.video("sessions/mug/clip.mkv", 0, MJPEG);
    inputs.video("sessions/.Trashes/clip.mkv", 0, MJPEG);
    fs::write(inputs.path("sessions/._mug"), "x").unwrap();
    let (code, errors) = inputs.extract(&["sessions", "--mask", "mask.png", "-o", "out"]);
    assert_eq!(code, Some(0), "{errors}");
    inputs.assert_sound(&["mug"]);
}

#[test]
fn what_lies_beside_sessions_is_named_once() {
    let inputs = Inputs::new();
    inputs.video("sessions/mug/clip.mkv", 0, MJPEG);
    fs::create_dir(inputs.path("sessions/cup")).unwrap();
    fs::write(inputs.path("sessions/cup/clip.insv"), "of a camera").unwrap();
    fs::write(inputs.path("sessions/notes.txt"), "text").unwrap();
    fs::rename(inputs.path("mask.png"), inputs.path("sessions/mask.png")).unwrap();
    let arguments = ["sessions", "--mask", "sessions/mask.png", "-o"];
    let output = inputs
        .0
        .command()
        .args(arguments)
        .args([
            "sessions/set",
            "--frames",
            "4",
            "--size",
            "16",
            "--align=off",
            "--json",
        ])
        .output()
        .unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(3), "{said}");
    let lines = said.lines().map(serde_json::from_str::<serde_json::Value>);
    let events: Vec<_> = lines.map(Result::unwrap).collect();
    let left_out = events.iter().filter(|event| event["event"] == "left_out");
    let mut left_out: Vec<&str> = left_out
        .map(|event| event["input"].as_str().unwrap())
        .collect();
    left_out.sort_unstable();
    assert_eq!(left_out, ["sessions/cup", "sessions/notes.txt"]);
    assert_eq!(events.last().unwrap()["left_out"], 2);
}

#[test]
fn masks_of_other_programs_mark_the_object_or_are_refused() {
    let inputs = Inputs::new();
    inputs.video("clip.mkv", 0, MJPEG);
    let colour = |x: u32, y: u32| [(4 * x) as u8, (5 * y) as u8, 60];
    let save = |name: &str, pixel: &dyn Fn(u32, u32) -> [u8; 4]| {
        RgbaImage::from_fn(64, 48, |x, y| Rgba(pixel(x, y)))
            .save(inputs.path(name))
            .unwrap();
    };
    save("cutout.png", &|x, y| {
        let [r, g, b] = colour(x, y);
        [r, g, b, if is_inside(x, y) { 255 } else { 0 }]
    });
    save("photo.png", &|x, y| {
        let [r, g, b] = colour(x, y);
        [r, g, b, 255]
    });
    let label = |x, y| Luma([u8::from(is_inside(x, y))]);
    GrayImage::from_fn(64, 48, label)
        .save(inputs.path("label.png"))
        .unwrap();
    let labels = |x: u32, y: u32| Luma([u8::from(is_inside(x, y)) * (1 + (x / 32) as u8)]);
    GrayImage::from_fn(64, 48, labels)
        .save(inputs.path("labels.png"))
        .unwrap();
    let lying = |x, y| Luma([if is_inside(y, x) { 255 } else { 0 }]);
    GrayImage::from_fn(48, 64, lying)
        .save(inputs.path("lying.png"))
        .unwrap();
    for (mask, noted) in [
        ("mask.png", false),
        ("cutout.png", true),
        ("label.png", true),
    ] {
        let (code, errors) = inputs.extract(&["clip.mkv", "--mask", mask, "-o", "out"]);
        assert_eq!(code, Some(0), "{mask}: {errors}");
        assert_eq!(
            is_named(&errors, &["warning", "mask"]),
            noted,
            "{mask}: {errors}"
        );
        assert_eq!(inputs.mask_px(), OBJECT_PX, "{mask}");
        fs::remove_dir_all(inputs.path("out")).unwrap();
    }
    for (mask, values) in [
        ("photo.png", &[][..]),
        ("labels.png", &["0, 1, 2"]),
        ("lying.png", &["48 x 64", "64 x 48"]),
    ] {
        let (code, errors) = inputs.extract(&["clip.mkv", "--mask", mask, "-o", "out"]);
        assert_eq!(code, Some(1), "{mask}: {errors}");
        assert!(
            is_named(&errors, &[&[mask], values].concat()),
            "{mask}: {errors}"
        );
        assert!(!inputs.path("out").join("clip.tar").exists(), "{mask}");
    }
}
