//! `relit-capture record`, watched while it runs.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread;
use std::time::{Duration, Instant};
use std::{env, fs};

use relit_data::session::{Manifest, Recording};
use serde_json::Value;

/// Long enough for an emulated machine whose host is busy.
const MAX_WAIT: Duration = Duration::from_secs(240);
/// Where a capture's standard error goes, among its sessions.
const STDERR: &str = "stderr.txt";
/// More lines than a capture prints.
const MAX_LINES: usize = 4096;
/// The settings of any capture here.
const ALWAYS: [&str; 7] = [
    "record",
    "--object",
    "mug",
    "--yes",
    "--json",
    "--retries",
    "0",
];

/// A program: from the folder `RIG_PROGRAMS`, else where cargo put it.
fn program(name: &str) -> PathBuf {
    match env::var_os("RIG_PROGRAMS") {
        Some(folder) => Path::new(&folder).join(name),
        None => relit_tests::program(name),
    }
}

/// A folder for the sessions of one test, empty.
pub(crate) fn sessions(test: &str) -> PathBuf {
    let folder = env::current_dir().unwrap().join("sessions").join(test);
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// A line that a capture printed.
#[derive(Debug)]
struct Event {
    at: Instant,
    what: Value,
}

/// A capture under way.
pub(crate) struct Running {
    child: Child,
    events: Receiver<Event>,
    seen: Vec<Event>,
    root: PathBuf,
}

impl Running {
    pub(crate) fn start(root: &Path, arguments: &[&str]) -> Self {
        let name = program("relit-capture");
        let mut child = Command::new(name)
            .args(ALWAYS)
            .arg("--root")
            .arg(root)
            .args(arguments)
            .env("XDG_RUNTIME_DIR", "/run")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(File::create(root.join(STDERR)).unwrap())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let (tell, events) = sync_channel(MAX_LINES);
        thread::spawn(move || {
            for line in lines.map_while(Result::ok) {
                // Nobody listens any more when the test is over.
                let _ = tell.send(Event {
                    at: Instant::now(),
                    what: serde_json::from_str(&line).unwrap(),
                });
            }
        });
        Self {
            child,
            events,
            seen: Vec::new(),
            root: root.to_owned(),
        }
    }

    /// Waits until the frames of the turn are being recorded, and then some.
    pub(crate) fn until_recording(&mut self) {
        let until = Instant::now() + MAX_WAIT;
        while !self
            .seen
            .iter()
            .any(|event| event.what["phase"] == "recording")
        {
            let left = until.saturating_duration_since(Instant::now());
            match self.events.recv_timeout(left) {
                Ok(event) => self.seen.push(event),
                Err(_) => panic!("no recording began: {:#?}", self.seen),
            }
        }
        thread::sleep(Duration::from_secs(3));
    }

    /// Waits for the end.
    pub(crate) fn end(mut self) -> Ended {
        let until = Instant::now() + MAX_WAIT;
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            if Instant::now() > until {
                self.child.kill().unwrap();
                panic!("the capture does not end: {:#?}", self.seen);
            }
            thread::sleep(Duration::from_millis(20));
        };
        self.seen.extend(self.events.iter());
        Ended {
            code: status.code(),
            events: self.seen,
            root: self.root,
        }
    }
}

/// A capture that is over.
#[derive(Debug)]
pub(crate) struct Ended {
    pub(crate) code: Option<i32>,
    events: Vec<Event>,
    root: PathBuf,
}

impl Ended {
    /// Why it came out as it did, as told to a person.
    pub(crate) fn reason(&self) -> &str {
        let told = self.events.iter().rev().find_map(|event| {
            let what = &event.what;
            let reason = match what["event"].as_str()? {
                "done" => &what["take"]["reason"],
                "error" => &what["message"],
                _ => return None,
            };
            reason.as_str()
        });
        told.unwrap_or("")
    }

    /// What a check found that is not as it should be.
    pub(crate) fn noted(&self, check: &str) -> String {
        let noted = self.events.iter().map(|event| &event.what);
        let noted = noted.filter(|what| what["what"] == check && what["good"] == false);
        let found: Vec<&str> = noted.filter_map(|what| what["found"].as_str()).collect();
        found.join("; ")
    }

    /// Checks that it was refused: told on standard error, with no session left, and before the
    /// table was told to move. Gives the reason.
    pub(crate) fn refusal(&self) -> &str {
        assert_eq!(self.code, Some(1), "{self:#?}");
        assert_eq!(self.folders().len(), 0, "{self:#?}");
        let moved = |event: &Event| event.what["phase"] == "moving-back";
        assert!(!self.events.iter().any(moved), "{self:#?}");
        let told = fs::read_to_string(self.root.join(STDERR)).unwrap();
        assert!(told.contains(self.reason()), "{told}");
        self.reason()
    }

    /// When it entered a phase.
    pub(crate) fn time_of(&self, phase: &str) -> Instant {
        let entered = self
            .events
            .iter()
            .find(|event| event.what["phase"] == phase);
        entered
            .unwrap_or_else(|| panic!("no {phase}: {self:#?}"))
            .at
    }

    /// The folders of its sessions.
    fn folders(&self) -> Vec<PathBuf> {
        let entries = fs::read_dir(&self.root).unwrap();
        entries
            .map(|entry| entry.unwrap().path())
            .filter(|path| path.is_dir())
            .collect()
    }

    /// The one session that it left, opened.
    pub(crate) fn session(&self) -> Recording {
        let folders = self.folders();
        assert_eq!(folders.len(), 1, "{folders:?} {:#?}", self.events);
        Recording::open(&folders[0]).unwrap()
    }

    /// The manifest of that session.
    pub(crate) fn manifest(&self) -> Manifest {
        self.session().manifest.unwrap()
    }
}

/// Runs `relit-extract` on a session, and gives its exit code and what it printed.
pub(crate) fn extract(session: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let name = program("relit-extract");
    let output = Command::new(name)
        .arg(session)
        .args(arguments)
        .output()
        .unwrap();
    let text = [output.stdout, output.stderr].concat();
    (
        output.status.code(),
        String::from_utf8_lossy(&text).into_owned(),
    )
}
