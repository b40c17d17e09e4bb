//! What `relit-capture record` leaves and with which exit code it ends.

use std::path::Path;
use std::process::{Command, Output};

use relit_data::session::recordings;
use relit_tests::is_named;

use crate::support::{SHORT, fixture};

/// Records a turn of ten seconds without a table, as fast as it is read.
fn record(root: &Path, camera: &str, arguments: &[&str]) -> Output {
    let usual = ["--turntable", "none", "--degrees-per-second", "36"];
    record_with(root, camera, &[&usual, arguments].concat())
}

/// Records with a table and a speed that `arguments` give.
fn record_with(root: &Path, camera: &str, arguments: &[&str]) -> Output {
    let address = format!("replay:{}?loop=1&speed=0{camera}", fixture(SHORT).display());
    let mut command = Command::new(relit_tests::program("relit-capture"));
    command.args(["record", "--object", "mug", "--json", "--camera", &address]);
    command.arg("--root").arg(root).args(arguments);
    command.output().unwrap()
}

#[test]
fn an_allowed_drop_leaves_one_session_and_exit_code_3_with_the_default_retries() {
    let root = tempfile::tempdir().unwrap();
    let output = record(root.path(), "&drop=200", &["--max-dropped", "5"]);
    assert_eq!(output.status.code(), Some(3), "{output:?}");
    assert_eq!(recordings(root.path()).unwrap().len(), 1);
    let text = String::from_utf8(output.stdout).unwrap();
    let last: serde_json::Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
    assert_eq!(last["event"], "done", "{text}");
    assert_eq!(last["take"]["verdict"], "tolerated", "{text}");
}

#[test]
fn a_speed_that_the_table_does_not_reach_is_one_sentence_before_anything_moves() {
    let root = tempfile::tempdir().unwrap();
    let sessions = root.path().join("sessions");
    let table = ["--turntable", "sim:?speed=0", "--yes"];
    let speed = ["--degrees-per-second", "72"];
    let output = record_with(&sessions, "", &[&table[..], &speed].concat());
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let text = String::from_utf8(output.stderr).unwrap();
    let speeds = text.lines().filter(|line| is_named(line, &["36", "72"]));
    assert_eq!(speeds.count(), 1, "{text}");
    assert!(!sessions.exists(), "{text}");
}

#[test]
fn a_drop_that_is_not_allowed_leaves_two_sessions_and_exit_code_1_with_the_default_retries() {
    let root = tempfile::tempdir().unwrap();
    let output = record(root.path(), "&drop=200", &[]);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert_eq!(recordings(root.path()).unwrap().len(), 2);
}

#[test]
fn a_replay_whose_controls_are_recorded_as_manual_has_no_remark_about_them() {
    let root = tempfile::tempdir().unwrap();
    let output = record(root.path(), "", &[]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    let events = text.lines().map(|line| serde_json::from_str(line).unwrap());
    let notes: Vec<serde_json::Value> = events
        .filter(|event: &serde_json::Value| event["event"] == "check" && event["good"] == false)
        .filter(|event| event["what"] == "camera settings")
        .collect();
    assert!(notes.is_empty(), "{notes:?}");
    let session = recordings(root.path()).unwrap().remove(0);
    let manifest = std::fs::read(session.join("session.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap();
    let controls = manifest["camera"]["controls"].as_object().unwrap();
    assert_eq!(controls.len(), 4, "{manifest}");
    let faults = manifest["faults"].as_array().unwrap();
    let of_the_take = faults.iter().filter(|fault| fault["t_us"] == 0);
    let said = of_the_take.map(|fault| fault["what"].as_str().unwrap());
    let named: Vec<&str> = said
        .filter(|what| controls.keys().any(|name| what.contains(name)))
        .collect();
    assert!(named.is_empty(), "{named:?}");
}

#[test]
fn a_name_that_no_object_can_have_is_wrong_usage() {
    let mut command = Command::new(relit_tests::program("relit-capture"));
    command.args(["record", "--object", "blue vase / 2", "--turntable", "none"]);
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{output:?}");
}

#[test]
fn a_camera_that_is_missing_is_named_before_anybody_is_asked() {
    let root = tempfile::tempdir().unwrap();
    let mut command = Command::new(relit_tests::program("relit-capture"));
    command.args([
        "record",
        "--object",
        "mug",
        "--camera",
        "v4l2:/dev/no-camera",
    ]);
    command.args(["--turntable", "serial:/dev/no-table", "--root"]);
    let output = command.arg(root.path().join("sessions")).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.contains("/dev/no-camera"), "{text}");
}
