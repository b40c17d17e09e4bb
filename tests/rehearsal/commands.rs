//! What `relit-capture record` leaves and with which exit code it ends.

use std::path::Path;
use std::process::{Command, Output};

use relit_data::session::recordings;

use crate::support::{SHORT, fixture};

/// Records a turn of ten seconds without a table, as fast as it is read.
fn record(root: &Path, camera: &str, arguments: &[&str]) -> Output {
    let address = format!("replay:{}?loop=1&speed=0{camera}", fixture(SHORT).display());
    let mut command = Command::new(relit_tests::program("relit-capture"));
    command.args(["record", "--object", "mug", "--turntable", "none", "--json"]);
    command.args(["--degrees-per-second", "36", "--camera", &address]);
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
    assert!(text.contains("\"verdict\":\"tolerated\""), "{text}");
}

#[test]
fn a_drop_that_is_not_allowed_leaves_two_sessions_and_exit_code_1_with_the_default_retries() {
    let root = tempfile::tempdir().unwrap();
    let output = record(root.path(), "&drop=200", &[]);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert_eq!(recordings(root.path()).unwrap().len(), 2);
}
