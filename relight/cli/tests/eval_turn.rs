//! `relight eval turn` as a user runs it, on turns that `relight synth sequences` makes.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn relight(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_relight"))
        .args(arguments)
        .output()
        .unwrap()
}

/// One small turn in a folder.
fn write_turn(folder: &Path) {
    let made = relight(&[
        "synth",
        "sequences",
        "--light-kind",
        "monte-carlo",
        "--seed",
        "12",
        "--count",
        "1",
        "--frames",
        "24",
        "--size",
        "48",
        "-o",
        folder.to_str().unwrap(),
    ]);
    assert!(made.status.success(), "{made:?}");
}

#[test]
fn a_turn_is_scored_by_each_method() {
    let dir = tempfile::tempdir().unwrap();
    let (data, table) = (dir.path().join("turns"), dir.path().join("table.json"));
    write_turn(&data);
    let output = relight(&[
        "eval",
        "turn",
        "--data",
        data.to_str().unwrap(),
        "-o",
        table.to_str().unwrap(),
    ]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("mean") && text.lines().count() > 3, "{text}");
    let json: serde_json::Value = serde_json::from_slice(&fs::read(table).unwrap()).unwrap();
    let measure = |line: usize| json["lines"][line]["measures"][0].clone();
    // Normals at random are 57 degrees off.
    for (line, method) in [(0, "light unknown"), (2, "light known")] {
        assert_eq!(json["lines"][line]["method"], method);
        let mean = measure(line);
        assert!(mean["value"].as_f64().unwrap() < 35.0, "{mean}");
        assert_eq!(measure(line + 1)["name"], "albedo");
    }
    assert_eq!(json["images"].as_array().unwrap().len(), 2);
}

/// What `relight turn` writes and warns of with these options.
fn solved(data: &Path, options: &[&str], out: &Path) -> (serde_json::Value, String) {
    let shard = data.join("synth-12-0000.tar");
    let mut arguments = vec!["turn", shard.to_str().unwrap()];
    arguments.extend(["-o", out.to_str().unwrap()]);
    arguments.extend(options);
    let output = relight(&arguments);
    assert!(matches!(output.status.code(), Some(0 | 3)), "{output:?}");
    let json = fs::read(out.join("turn.json")).unwrap();
    let told = String::from_utf8(output.stderr).unwrap();
    (serde_json::from_slice(&json).unwrap(), told)
}

#[test]
fn a_turn_read_the_wrong_way_is_doubted_by_the_network() {
    let dir = tempfile::tempdir().unwrap();
    let data = dir.path().join("turns");
    write_turn(&data);
    let given = |direction: &str| {
        let options = ["--elevation", "20", "--rotation", direction];
        solved(&data, &options, &dir.path().join(direction))
    };
    let ((right, told), (wrong, warned)) = (given("counter-clockwise"), given("clockwise"));
    let other = |json: &serde_json::Value| json["network"]["other_direction_deg"].as_f64().unwrap();
    let least = right["network"]["expected_error_deg"].as_f64().unwrap();
    assert!((least - other(&wrong)).abs() < 1e-3, "{right} {wrong}");
    assert!(other(&right) > other(&wrong), "{right} {wrong}");
    assert!(!told.contains("--rotation"), "{told}");
    assert!(warned.contains("--rotation counter-clockwise"), "{warned}");
}

/// Gives each frame of a shard the angle that it has on a table that turns the other way.
fn turn_around(shard: &Path) {
    let mut bytes = fs::read(shard).unwrap();
    let key = b"\"angle_deg\":";
    let mut at = 0;
    while let Some(found) = bytes[at..].windows(key.len()).position(|part| part == key) {
        let begin = at + found + key.len();
        let length = bytes[begin..]
            .iter()
            .position(|&byte| byte == b',')
            .unwrap();
        let text = std::str::from_utf8(&bytes[begin..begin + length]).unwrap();
        let angle: f64 = text.parse().unwrap();
        // Frames are 15 degrees apart, so that the other angle is no longer than the first.
        let other = format!("{:<length$}", (360.0 - angle) % 360.0);
        bytes[begin..begin + length].copy_from_slice(other.as_bytes());
        at = begin + length;
    }
    fs::write(shard, bytes).unwrap();
}

#[test]
fn the_rotation_direction_that_nobody_says_is_found() {
    let dir = tempfile::tempdir().unwrap();
    let data = dir.path().join("turns");
    write_turn(&data);
    let (usual, told) = solved(&data, &[], &dir.path().join("usual"));
    turn_around(&data.join("synth-12-0000.tar"));
    let (found, warned) = solved(&data, &[], &dir.path().join("found"));
    let rotation =
        |direction: &str| serde_json::json!({"direction": direction, "source": "network"});
    assert_eq!(usual["rotation"], rotation("counter-clockwise"));
    assert_eq!(found["rotation"], rotation("clockwise"));
    let taken = "--rotation clockwise";
    assert!(!told.contains(taken) && warned.contains(taken), "{warned}");
    let residual = |json: &serde_json::Value| json["residual"].as_f64().unwrap();
    let (as_usual, as_found) = (residual(&usual), residual(&found));
    assert!((as_usual / as_found - 1.0).abs() < 1e-3, "{usual} {found}");
}

#[test]
fn a_folder_that_holds_no_turns_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let data = dir.path().to_str().unwrap();
    let output = relight(&["eval", "turn", "--data", data]);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(told.contains(data), "{told}");
}
