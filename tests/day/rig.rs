//! The programs at the rig, with a bundled recording as the camera and a simulated table.

use std::fs;
use std::io::{BufRead, BufReader};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use relit_turntable::simulator::Simulator;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

/// What stands on the table, and how it turns.
#[derive(Debug)]
pub(crate) struct Turn {
    recording: &'static str,
    degrees_per_second: f64,
    /// Frames of a take.
    pub(crate) frames: u32,
    /// Longest wait for a step.
    pub(crate) longest: Duration,
}

/// A turn as fast as the table can: each frame of the recording twice.
pub(crate) const SHORT_TURN: Turn = Turn {
    recording: "20261120T101500Z-cow-short",
    degrees_per_second: 36.0,
    frames: 300,
    longest: Duration::from_secs(600),
};

/// Slow enough for something to happen meanwhile.
pub(crate) const SLOW_TURN: Turn = Turn {
    degrees_per_second: 7.2,
    frames: 1500,
    ..SHORT_TURN
};

/// The turn that the programs are made for.
pub(crate) const LONG_TURN: Turn = Turn {
    recording: "20261120T093015Z-cow",
    degrees_per_second: 7.2,
    frames: 1500,
    longest: Duration::from_secs(1800),
};

/// The name of the table's port, in the folder of the rig.
const PORT: &str = "table";
/// The variable with the address to listen on.
const LISTEN: &str = "RELIT_TEST_LISTEN";

impl Turn {
    /// The address of the recording as a camera.
    pub(crate) fn camera(&self) -> String {
        format!("replay:fixtures/{}?loop=1", self.recording)
    }
}

/// `relit-capture serve`, until the test ends.
#[derive(Debug)]
pub(crate) struct Rig {
    child: Child,
    command: Command,
    pub(crate) url: String,
    pub(crate) turn: &'static Turn,
    folder: tempfile::TempDir,
}

impl Rig {
    /// With `relit-mask` and `relit-extract` beside it.
    pub(crate) fn start(turn: &'static Turn) -> Self {
        Self::start_at(turn, &turn.camera(), "sim:")
    }

    /// With another camera or table.
    pub(crate) fn start_at(turn: &'static Turn, camera: &str, table: &str) -> Self {
        Self::start_in(tempfile::tempdir().unwrap(), turn, camera, table)
    }

    /// With a table that the test has in its hands, at a port.
    pub(crate) fn start_with(turn: &'static Turn, table: &Simulator) -> Self {
        let folder = tempfile::tempdir().unwrap();
        symlink(table.path(), folder.path().join(PORT)).unwrap();
        Self::start_in(folder, turn, &turn.camera(), &format!("serial:{PORT}"))
    }

    fn start_in(folder: tempfile::TempDir, turn: &'static Turn, camera: &str, table: &str) -> Self {
        for program in ["relit-mask", "relit-extract"] {
            assert!(relit_tests::program(program).is_file());
        }
        let mut command = program(&relit_tests::program("relit-capture"));
        command.args(["serve", "--camera", camera, "--turntable", table]);
        Self::serve(command, turn, folder)
    }

    /// As on a machine that has the rig's program alone.
    pub(crate) fn start_without_programs(turn: &'static Turn) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let copy = folder.path().join("relit-capture");
        fs::copy(relit_tests::program("relit-capture"), &copy).unwrap();
        let mut command = program(&copy);
        command.args(["serve", "--camera", &turn.camera(), "--turntable", "sim:"]);
        Self::serve(command, turn, folder)
    }

    /// In a folder of its own, by relative paths: the page shows them, and its pictures no path of this machine. It finds
    /// the programs beside it and nothing else, `nice` neither: they would wait for whatever else this machine does.
    fn serve(mut command: Command, turn: &'static Turn, folder: tempfile::TempDir) -> Self {
        symlink(fixtures(), folder.path().join("fixtures")).unwrap();
        command
            .arg("--json")
            .args(["--degrees-per-second", &turn.degrees_per_second.to_string()])
            .args(["--root", "sessions", "--datasets", "."])
            .current_dir(&folder)
            .env("PATH", folder.path())
            .stdout(Stdio::piped());
        let (child, serving) = started(command.env(LISTEN, "127.0.0.1:0"));
        // Another start takes the same port.
        command.env(LISTEN, serving["address"].as_str().unwrap());
        Self {
            url: serving["url"].as_str().unwrap().to_owned(),
            child,
            command,
            turn,
            folder,
        }
    }

    /// Ends the program and starts it again, at the same address.
    pub(crate) fn restart(&mut self) {
        self.end();
        (self.child, _) = started(&mut self.command);
    }

    /// It ends its programs when it is asked to end.
    fn end(&mut self) {
        let _ = kill_process(Pid::from_child(&self.child), Signal::TERM);
        let _ = self.child.wait();
    }

    /// Puts the recording itself among the sessions; returns its name.
    pub(crate) fn hold_recorded(&self) -> String {
        let (from, name) = (recording(self.turn), self.turn.recording);
        let to = self.sessions().join(name);
        fs::create_dir_all(&to).unwrap();
        for file in ["frames.jsonl", "video.mkv", "session.json"] {
            fs::copy(from.join(file), to.join(file)).unwrap();
        }
        name.to_owned()
    }

    /// The folder of the sessions, by the name that the programs are given.
    pub(crate) fn sessions(&self) -> PathBuf {
        let folder = self.folder.path().canonicalize().unwrap();
        folder.join("sessions")
    }

    /// The folder of the data set.
    pub(crate) fn dataset(&self) -> PathBuf {
        self.sessions().with_file_name("dataset")
    }

    /// The true mask of what stands on the table.
    pub(crate) fn true_mask(&self) -> image::GrayImage {
        let file = recording(self.turn).join("mask_gt.png");
        image::open(file).unwrap().into_luma8()
    }

    /// Reads the data set back.
    pub(crate) fn verify(&self) -> Output {
        let mut command = Command::new(relit_tests::program("relit-extract"));
        command.arg("verify").arg(self.dataset());
        command.output().unwrap()
    }
}

fn recording(turn: &Turn) -> PathBuf {
    fixtures().join(turn.recording)
}

fn fixtures() -> PathBuf {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures");
    fixtures.canonicalize().unwrap()
}

/// A program that listens where an environment variable says, which can be changed between two starts.
fn program(path: &Path) -> Command {
    let mut command = Command::new("/bin/sh");
    command.args(["-c", &format!("exec \"$@\" --listen \"${LISTEN}\""), "sh"]);
    command.arg(path);
    command
}

/// A program at work, and where it serves.
fn started(command: &mut Command) -> (Child, Value) {
    let mut child = command.spawn().unwrap();
    let mut line = String::new();
    let output = child.stdout.take().unwrap();
    BufReader::new(output).read_line(&mut line).unwrap();
    (child, serde_json::from_str(&line).unwrap())
}

impl Drop for Rig {
    fn drop(&mut self) {
        self.end();
    }
}
