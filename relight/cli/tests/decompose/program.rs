//! What crosses the border of the process: arguments, files, messages and exit codes.

use std::fs;
use std::process::{Command, Output};

use relight_photo::nets::{WeightPrecision, Weights, decomposer};

use crate::support::{Folder, names_in, object};

fn relight(folder: &Folder, arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_relight"))
        .args(arguments.split(' '))
        .current_dir(folder.0.path())
        .output()
        .unwrap()
}

fn code_and_errors(output: &Output) -> (i32, String) {
    let errors = String::from_utf8(output.stderr.clone()).unwrap();
    (output.status.code().unwrap(), errors)
}

#[test]
fn a_file_of_a_folder_that_is_not_used_is_named_and_the_code_says_so() {
    let folder = Folder::new();
    let weights = Weights::initial(&decomposer(), 3);
    weights
        .write(&folder.path("w.safetensors"), WeightPrecision::Half)
        .unwrap();
    fs::create_dir(folder.path("photos")).unwrap();
    object(0).save(folder.path("photos/black.png")).unwrap();
    fs::write(folder.path("photos/._black.png"), "of macOS").unwrap();
    let command = "decompose photos -o out --weights w.safetensors --json";
    assert_eq!(code_and_errors(&relight(&folder, command)).0, 0);
    fs::write(
        folder.path("photos/x.avif"),
        b"\0\0\0\x18ftypavif\0\0\0\0avifmif1",
    )
    .unwrap();
    let output = relight(&folder, command);
    let (code, errors) = code_and_errors(&output);
    assert_eq!(code, 3, "{errors}");
    let events = String::from_utf8(output.stdout).unwrap();
    let mut events = events
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    let unused = events.find(|event| event["event"] == "unused").unwrap();
    assert_eq!(unused["file"], "photos/x.avif");
}

#[test]
fn the_program_decomposes_what_it_can_and_names_what_it_left_out() {
    let folder = Folder::new();
    let weights = Weights::initial(&decomposer(), 3);
    weights
        .write(&folder.path("w.safetensors"), WeightPrecision::Half)
        .unwrap();
    fs::create_dir(folder.path("photos")).unwrap();
    object(0).save(folder.path("photos/black.png")).unwrap();
    object(90).save(folder.path("photos/grey.png")).unwrap();
    let command = "decompose photos -o out --weights w.safetensors --json";
    let output = relight(&folder, command);
    let (code, errors) = code_and_errors(&output);
    assert_eq!(code, 3, "{errors}");
    assert!(errors.contains("photos/grey.png"), "{errors}");
    assert_eq!(names_in(&folder.path("out")), ["black"]);
    let lines = String::from_utf8(output.stdout).unwrap();
    let events: Vec<serde_json::Value> = lines
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    // Side by side: in the order in which they were done.
    let of = |name: &str| events.iter().find(|event| event["event"] == name);
    assert_eq!(
        of("decomposed").unwrap()["figures"]["weights"],
        "w.safetensors"
    );
    assert_eq!(of("failed").unwrap()["photo"], "photos/grey.png");
    assert_eq!(events.len(), 2);

    for (command, code, named) in [
        ("decompose turn.tar -o o", 1, "relight turn"),
        (
            "weights export w.safetensors -o w.txt",
            2,
            "relight weights export",
        ),
        (
            "decompose photos -o w.safetensors --weights w.safetensors",
            1,
            "w.safetensors",
        ),
        (
            "decompose photos/black.png -o o --weights none.safetensors",
            1,
            "none.safetensors",
        ),
        ("decompose photos --mask w.safetensors -o o", 2, "--mask"),
        ("decompose photos/black.png --rect 1,2,3 -o o", 2, "X,Y,W,H"),
        ("decompose photos/black.png", 2, "--output"),
        ("weights export w.safetensors -o w.txt", 2, ".onnx"),
        (
            "weights export w.safetensors --net normal-net -o w.onnx",
            1,
            "normal-net",
        ),
        (
            "weights export --net normal-net -o w.onnx",
            2,
            "contains none",
        ),
    ] {
        let (found, errors) = code_and_errors(&relight(&folder, command));
        assert_eq!(found, code, "{command}: {errors}");
        assert!(errors.contains(named), "{command}: {errors}");
    }
    assert!(!folder.path("o").exists() && !folder.path("w.onnx").exists());

    let command = "weights export w.safetensors -o w.onnx";
    assert_eq!(
        code_and_errors(&relight(&folder, command)),
        (0, String::new())
    );
    assert!(fs::metadata(folder.path("w.onnx")).unwrap().len() > 1_000_000);
}

#[test]
fn the_weights_that_come_with_the_program_are_exported() {
    let folder = Folder::new();
    let size = |name: &str| fs::metadata(folder.path(name)).unwrap().len();
    for (net, most) in [("decomposer", 20_000_000), ("turn-net", 11_000_000)] {
        let command = format!("weights export --net {net} -o {net}.onnx");
        let output = relight(&folder, &command);
        assert_eq!(code_and_errors(&output), (0, String::new()));
        let found = size(&format!("{net}.onnx"));
        assert!((4_000_000..most).contains(&found), "{net}: {found}");
    }
}

#[test]
fn photographs_side_by_side_come_out_as_one_by_one() {
    let folder = Folder::new();
    let weights = Weights::initial(&decomposer(), 3);
    weights
        .write(&folder.path("w.safetensors"), WeightPrecision::Half)
        .unwrap();
    fs::create_dir(folder.path("photos")).unwrap();
    for (name, shade) in [("a", 0), ("b", 3), ("c", 6), ("d", 90), ("e", 9)] {
        object(shade)
            .save(folder.path(&format!("photos/{name}.png")))
            .unwrap();
    }
    for threads in ["1", "3"] {
        let command =
            format!("decompose photos --weights w.safetensors --threads {threads} -o {threads}");
        let (code, errors) = code_and_errors(&relight(&folder, &command));
        assert_eq!((code, errors.lines().count()), (3, 1), "{errors}");
        assert!(errors.contains("photos/d.png"), "{errors}");
    }
    assert_eq!(names_in(&folder.path("1")), ["a", "b", "c", "e"]);
    for name in names_in(&folder.path("1")) {
        let [one, three] = ["1", "3"].map(|threads| folder.path(threads).join(&name));
        assert_eq!(names_in(&one), names_in(&three));
        for file in names_in(&one) {
            let [one, three] = [&one, &three].map(|results| fs::read(results.join(&file)).unwrap());
            assert!(one == three, "{name}/{file}");
        }
    }
}
