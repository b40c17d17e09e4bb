//! Combinations of unusable and of odd input: a sentence and exit code 1 or 2, or a mask; never a
//! panic.

use std::fs;
use std::path::Path;

use super::program::turn_video;
use super::support::{clip, code, relit_mask, said};
use relit_test_support::disc::{AROUND, HEIGHT, WIDTH, seeds_image, strokes};

/// Arguments for one place of the command line.
type Choice = &'static [&'static str];

const RECTS: [Choice; 11] = [
    &[],
    &["--rect", AROUND],
    &["--rect", "0,0,96,64"],
    &["--rect", "-9,-9,999,999"],
    &["--rect", "0,0,0,0"],
    &["--rect", "500,500,9,9"],
    &["--rect", "47,31,1,1"],
    &["--rect", "2147483647,2147483647,4294967295,4294967295"],
    &["--rect", "-2147483648,-2147483648,4294967295,4294967295"],
    &["--rect", "1,2,3"],
    &["--rect", "a,b,c,d"],
];
const SEEDS: [Choice; 9] = [
    &[],
    &["--seeds", "strokes.png"],
    &["--seeds", "black.png"],
    &["--seeds", "white.png"],
    &["--seeds", "grey.png"],
    &["--seeds", "small.png"],
    &["--seeds", "cut.png"],
    &["--seeds", "empty.png"],
    &["--seeds", "nothing.png"],
];
const WAYS: [Choice; 4] = [
    &[],
    &["--auto"],
    &["--frame", "99"],
    &["--auto", "--keep-all"],
];
const INPUTS: [&str; 8] = [
    "clip.y4m",
    "turn.y4m",
    "tiny.y4m",
    "plain.y4m",
    "cut.y4m",
    "empty.y4m",
    "text.mkv",
    "nothing.mkv",
];

fn lay_out(folder: &Path) {
    let write = |name: &str, bytes: &[u8]| fs::write(folder.join(name), bytes).unwrap();
    write("turn.y4m", &turn_video());
    let whole = fs::read(folder.join("clip.y4m")).unwrap();
    write("cut.y4m", &whole[..whole.len() / 6]);
    write("empty.y4m", b"");
    write("text.mkv", b"this is no video");
    let video = |width: u32, height: u32, frames: usize| {
        let mut bytes = format!("YUV4MPEG2 W{width} H{height} F30:1 Ip A1:1 C444\n").into_bytes();
        for _ in 0..frames {
            bytes.extend_from_slice(b"FRAME\n");
            bytes.extend(vec![128; (3 * width * height) as usize]);
        }
        bytes
    };
    write("tiny.y4m", &video(8, 8, 5));
    write("plain.y4m", &video(WIDTH, HEIGHT, 5));
    let save = |name: &str, image: image::GrayImage| image.save(folder.join(name)).unwrap();
    save("strokes.png", seeds_image(strokes));
    save("black.png", seeds_image(|_, _| 0));
    save("white.png", seeds_image(|_, _| 255));
    save("grey.png", seeds_image(|_, _| 128));
    save("small.png", image::GrayImage::new(5, 5));
    let png = fs::read(folder.join("strokes.png")).unwrap();
    write("cut.png", &png[..png.len() / 2]);
    write("empty.png", b"");
}

/// Runs the program, and says what is wrong with how it ended.
fn fault(folder: &Path, arguments: &[&str]) -> Option<String> {
    let output = relit_mask(folder, arguments);
    let text = said(&output);
    let sentence = text.lines().any(|line| line.starts_with("error: "));
    let wrong = match code(&output) {
        0 => !folder.join("out.png").is_file(),
        1 | 2 => !sentence || folder.join("out.png").exists(),
        _ => true,
    };
    for name in ["out.png", "out.json", "out-preview.png"] {
        // It may not be there.
        let _ = fs::remove_file(folder.join(name));
    }
    let wrong = wrong || text.contains("panicked");
    wrong.then(|| format!("{arguments:?}: {}: {text}", output.status))
}

#[test]
fn all_pairs_of_bad_input_end_with_a_mask_or_a_sentence() {
    let folder = clip();
    lay_out(folder.path());
    let mut faults = Vec::new();
    // Each pair of hints on a good video, each hint beside a turn, and each video with some hints.
    let mut run = |input: &str, parts: [Choice; 3]| {
        let arguments = [&[input][..], &parts.concat(), &["-o", "out.png"]].concat();
        faults.extend(fault(folder.path(), &arguments));
    };
    for (&rect, &seeds, &way) in combinations(&RECTS, &SEEDS, &WAYS[..1]) {
        run("clip.y4m", [rect, seeds, way]);
    }
    for (&rect, &seeds, &way) in combinations(&RECTS, &SEEDS[..1], &WAYS[1..]) {
        run("turn.y4m", [rect, seeds, way]);
    }
    for (&rect, &seeds, &way) in combinations(&RECTS[..1], &SEEDS[1..], &WAYS[1..2]) {
        run("turn.y4m", [rect, seeds, way]);
    }
    for (&input, &rect, &way) in combinations(&INPUTS, &RECTS[..2], &WAYS[..2]) {
        run(input, [rect, SEEDS[0], way]);
        run(input, [rect, SEEDS[1], way]);
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

fn combinations<'a, A, B, C>(
    first: &'a [A],
    second: &'a [B],
    third: &'a [C],
) -> impl Iterator<Item = (&'a A, &'a B, &'a C)> {
    first.iter().flat_map(move |a| {
        second
            .iter()
            .flat_map(move |b| third.iter().map(move |c| (a, b, c)))
    })
}

#[test]
fn a_recipe_that_was_changed_by_hand_ends_with_a_sentence() {
    let folder = clip();
    let path = folder.path();
    let made = relit_mask(path, &["clip.y4m", "--rect", AROUND, "-o", "made.png"]);
    assert_eq!(code(&made), 0, "{}", said(&made));
    let whole = fs::read_to_string(path.join("made.json")).unwrap();
    let stroke = |stroke: &str| {
        whole.replace(
            "\"rect\": [",
            &format!("\"strokes\": [{stroke}],\n    \"rect\": ["),
        )
    };
    let changed = [
        String::new(),
        "{}".to_owned(),
        "[1]".to_owned(),
        whole[..whole.len() / 2].to_owned(),
        whole.replace("relit.mask/1", "relit.mask/9"),
        whole.replace("\"frame\": 0", "\"frame\": 77"),
        whole.replace("\"frame\": 0", "\"frame\": -1"),
        whole.replace("\"width\": 96", "\"width\": 4294967295"),
        whole.replace("\"keep_all\": false", "\"keep_all\": 5"),
        whole.replace("\"seeds\": null", "\"seeds\": \"%%%\""),
        whole.replace("\"seeds\": null", "\"seeds\": \"aaaa\""),
        stroke(r#"{"brush": "object", "radius": -1, "points": [[1, 1]]}"#),
        stroke(r#"{"brush": "object", "radius": 1, "points": []}"#),
        stroke(r#"{"brush": "object", "radius": 1, "points": [[1e30, 1]]}"#),
        stroke(r#"{"brush": "magic", "radius": 1, "points": [[1, 1]]}"#),
        stroke(r#"{"brush": "background", "radius": 99999, "points": [[1, 1]]}"#),
    ];
    for (at, text) in changed.iter().enumerate() {
        assert_ne!(*text, whole, "{at}");
        fs::write(path.join("changed.json"), text).unwrap();
        for force in [&[][..], &["--force"]] {
            let arguments = [
                &["clip.y4m", "--recipe", "changed.json", "-o", "out.png"],
                force,
            ]
            .concat();
            if let Some(fault) = fault(path, &arguments) {
                panic!("{at}: {fault}");
            }
        }
    }
}
