//! A folder, and the program in it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

pub(crate) const COW: &str = "20261120T101500Z-cow-short";
pub(crate) const BUST: &str = "20261120T102000Z-bust-short";

/// A session that comes with the repository.
pub(crate) fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../fixtures")
        .join(name)
}

pub(crate) struct Place(TempDir);

impl Place {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub(crate) fn folder(&self) -> &Path {
        self.0.path()
    }

    pub(crate) fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.folder().join(name)
    }

    pub(crate) fn command(&self) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_relit-extract"));
        command.current_dir(self.folder());
        command
    }

    pub(crate) fn run(&self, line: &str) -> Output {
        let arguments = line.split_whitespace();
        self.command().args(arguments).output().unwrap()
    }

    /// Runs the program, asserts the exit code, and returns standard error.
    #[track_caller]
    pub(crate) fn errors(&self, code: i32, line: &str) -> String {
        let output = self.run(line);
        let errors = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{line}: {errors}");
        errors
    }

    /// Runs the program with `--json`, asserts the exit code, and returns its events.
    #[track_caller]
    pub(crate) fn events(&self, code: i32, line: &str) -> Vec<Value> {
        let output = self.run(&format!("{line} --json"));
        let errors = String::from_utf8_lossy(&output.stderr);
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(code), "{line}: {errors}{text}");
        text.lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect()
    }
}
