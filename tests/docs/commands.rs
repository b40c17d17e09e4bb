//! The commands of a page, found and run.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::{env, fs};

/// How a block begins that is run.
const BEGIN: &str = "```sh run";
const END: &str = "```";
/// The programs that the blocks call.
const PROGRAMS: [&str; 4] = ["relit-capture", "relit-mask", "relit-extract", "relight"];

/// A block of commands.
pub(crate) struct Block {
    /// The line of its first command in the page, from 1.
    line: usize,
    commands: String,
}

/// The blocks of a page that are run.
pub(crate) fn blocks(page: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut lines = (1..).zip(page.lines());
    while let Some((number, line)) = lines.next() {
        if line == BEGIN {
            let inside = lines.by_ref().map(|(_, line)| line);
            let commands: Vec<&str> = inside.take_while(|line| *line != END).collect();
            blocks.push(Block {
                line: number + 1,
                commands: commands.join("\n"),
            });
        }
    }
    blocks
}

/// The folder of the programs, which cargo builds beside this test.
///
/// # Errors
/// If one of them was not built.
pub(crate) fn programs() -> Result<PathBuf, String> {
    let mut folder = PathBuf::new();
    for name in PROGRAMS {
        let program = relit_tests::beside_this_test(name).map_err(|error| error.to_string())?;
        if !program.is_file() {
            return Err(format!("{} was not built", program.display()));
        }
        folder = program.parent().unwrap_or(Path::new("")).to_owned();
    }
    Ok(folder)
}

/// Runs the blocks of a page in a folder of their own.
///
/// # Panics
/// If a command fails.
pub(crate) fn run(page: &str, blocks: &[Block], programs: &Path) {
    let folder = tempfile::tempdir().unwrap();
    copy(
        &crate::root().join("fixtures"),
        &folder.path().join("fixtures"),
    );
    for block in blocks {
        let output = Command::new("bash")
            .args(["-e", "-u", "-x", "-o", "pipefail", "-c", &block.commands])
            .current_dir(folder.path())
            .env("PATH", path_with(programs))
            .stdin(Stdio::null())
            .output()
            .unwrap();
        assert!(
            output.status.success(),
            "{page}:{}: {}\n{}{}",
            block.line,
            output.status,
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr)
        );
    }
}

/// `PATH` with the folder of the programs before all others.
fn path_with(programs: &Path) -> std::ffi::OsString {
    let path = env::var_os("PATH").unwrap_or_default();
    let folders = [programs.to_owned()]
        .into_iter()
        .chain(env::split_paths(&path));
    env::join_paths(folders).unwrap()
}

/// Copies a folder with all that it holds.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}
