//! The server from outside: a rig that only pretends, real sockets on loopback, and a client that is as
//! plain as can be, so that it can also behave badly.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr
)]

mod api;
mod load;
mod page;
mod previews;
mod processing;
mod security;
mod sessions;
mod states;

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use serde_json::Value;

use super::{Announcement, ServeOptions, Shutdown, serve};
use crate::command::{Command, CommandError, Rig};
use crate::state::{Monitor, Phase};

/// Longest wait for anything in these tests; all that is waited for comes far sooner.
const LONG: Duration = Duration::from_secs(120);
/// Between two questions whether something is so.
const ASKED_EVERY: Duration = Duration::from_millis(5);
/// What begins and ends as a JPEG does.
const PICTURE: &[u8] = &[0xFF, 0xD8, 1, 2, 3, 4, 0xFF, 0xD9];

/// What the rig says where it refuses.
const NO_TABLE: &str = "there is no table";
const TOO_FAR: &str = "no table turns so far";
const BUSY: &str = "a capture is under way: stop it first";

/// A rig that takes one start at a time and notes what it is told.
struct Fake {
    monitor: Monitor,
    root: PathBuf,
    told: Mutex<Vec<Command>>,
    /// Whether it refuses what its state does not allow, as the daemon does.
    minds_state: AtomicBool,
}

impl Rig for Fake {
    fn command(&self, command: Command) -> Result<(), CommandError> {
        self.told.lock().unwrap().push(command.clone());
        if self.minds_state.load(Ordering::Relaxed) {
            return command.check(&self.monitor.state());
        }
        match command {
            Command::Start { object, .. } => self.start(&object),
            Command::Home => Err(CommandError::Unavailable(NO_TABLE.to_owned())),
            Command::Jog { .. } => Err(CommandError::Invalid(TOO_FAR.to_owned())),
            Command::Stop => {
                self.monitor.update(|state| state.phase = Phase::Idle);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn monitor(&self) -> &Monitor {
        &self.monitor
    }

    fn root(&self) -> &Path {
        &self.root
    }
}

impl Fake {
    fn start(&self, object: &str) -> Result<(), CommandError> {
        let mut taken = false;
        self.monitor.update(|state| {
            taken = state.phase == Phase::Idle;
            if taken {
                state.phase = Phase::Recording;
                state.object = Some(object.to_owned());
            }
        });
        let busy = || CommandError::Busy(BUSY.to_owned());
        taken.then_some(()).ok_or_else(busy)
    }
}

/// A server at work. Ends with its test.
struct Serving {
    rig: Arc<Fake>,
    told: Announcement,
    shutdown: Shutdown,
    thread: Option<JoinHandle<()>>,
    root: tempfile::TempDir,
}

impl Serving {
    fn start() -> Self {
        Self::with(|_| {})
    }

    fn with(change: impl FnOnce(&mut ServeOptions)) -> Self {
        Self::beside(|options, _| change(options))
    }

    /// With what the options need to know of the rig.
    fn beside(change: impl FnOnce(&mut ServeOptions, &Fake)) -> Self {
        let root = tempfile::tempdir().unwrap();
        let rig = Arc::new(Fake {
            monitor: Monitor::default(),
            root: root.path().to_owned(),
            told: Mutex::new(Vec::new()),
            minds_state: AtomicBool::new(false),
        });
        let mut options = ServeOptions::at("127.0.0.1:0".parse().unwrap());
        change(&mut options, &rig);
        let shutdown = Shutdown::new();
        let (tell, told) = mpsc::sync_channel(1);
        let thread = {
            let (rig, shutdown) = (rig.clone(), shutdown.clone());
            thread::spawn(move || {
                serve(rig, options, &shutdown, |told| {
                    tell.send(told.clone()).unwrap();
                })
                .unwrap();
            })
        };
        Self {
            rig,
            told: told.recv_timeout(LONG).unwrap(),
            shutdown,
            thread: Some(thread),
            root,
        }
    }

    /// Lays sessions of `fixtures/` into the rig's folder.
    fn hold(&self, names: &[&str]) {
        for name in names {
            let from = Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("../../fixtures")
                .join(name);
            let to = self.root.path().join(name);
            std::fs::create_dir(&to).unwrap();
            for file in ["session.json", "frames.jsonl", "video.mkv"] {
                std::fs::copy(from.join(file), to.join(file)).unwrap();
            }
        }
    }

    fn connect(&self) -> TcpStream {
        connect(self.told.address)
    }

    fn host(&self) -> String {
        self.told.address.to_string()
    }

    /// Asks with any method, header lines and body.
    fn ask(&self, method: &str, path: &str, headers: &[&str], body: &[u8]) -> Answer {
        ask(self.told.address, method, path, headers, body)
    }

    fn get(&self, path: &str) -> Answer {
        self.ask("GET", path, &[], b"")
    }

    fn command(&self, body: &str) -> Answer {
        let headers = ["Content-Type: application/json"];
        self.ask("POST", "/api/v1/command", &headers, body.as_bytes())
    }

    fn stop(&mut self) {
        self.shutdown.cancel();
        self.thread.take().unwrap().join().unwrap();
    }
}

impl Drop for Serving {
    fn drop(&mut self) {
        if self.thread.is_some() {
            self.stop();
        }
    }
}

fn connect(address: SocketAddr) -> TcpStream {
    let socket = TcpStream::connect(address).unwrap();
    socket.set_read_timeout(Some(LONG)).unwrap();
    socket.set_write_timeout(Some(LONG)).unwrap();
    socket
}

fn ask(address: SocketAddr, method: &str, path: &str, headers: &[&str], body: &[u8]) -> Answer {
    let mut socket = connect(address);
    let host = if headers.iter().any(|line| line.starts_with("Host:")) {
        String::new()
    } else {
        format!("Host: {address}\r\n")
    };
    let lines: String = headers.iter().map(|line| format!("{line}\r\n")).collect();
    let length = match method {
        "GET" => String::new(),
        _ => format!("Content-Length: {}\r\n", body.len()),
    };
    let head =
        format!("{method} {path} HTTP/1.1\r\n{host}Connection: close\r\n{lines}{length}\r\n");
    socket.write_all(head.as_bytes()).unwrap();
    socket.write_all(body).unwrap();
    let mut answer = Answer::head(socket);
    answer.rest();
    answer
}

/// An answer, read so far.
struct Answer {
    status: u16,
    headers: Vec<(String, String)>,
    body: Vec<u8>,
    reader: BufReader<TcpStream>,
}

impl Answer {
    /// Reads status and headers.
    fn head(socket: TcpStream) -> Self {
        let mut reader = BufReader::new(socket);
        let mut line = String::new();
        reader.read_line(&mut line).unwrap();
        let status = line.split(' ').nth(1).unwrap_or_default();
        let status = status.parse().unwrap_or_else(|_| panic!("{line:?}"));
        let mut headers = Vec::new();
        loop {
            let mut line = String::new();
            reader.read_line(&mut line).unwrap();
            match line.trim_end().split_once(": ") {
                Some((name, value)) => headers.push((name.to_owned(), value.to_owned())),
                None => break,
            }
        }
        Self {
            status,
            headers,
            body: Vec::new(),
            reader,
        }
    }

    /// Reads the body to its end; of a chunked one only the plain bytes are of use.
    fn rest(&mut self) {
        self.reader.read_to_end(&mut self.body).unwrap();
    }

    fn header(&self, name: &str) -> Option<&str> {
        let mut headers = self.headers.iter();
        let found = headers.find(|(known, _)| known.eq_ignore_ascii_case(name));
        found.map(|(_, value)| value.as_str())
    }

    fn json(&self) -> Value {
        serde_json::from_slice(&self.body)
            .unwrap_or_else(|_| panic!("{:?}", String::from_utf8_lossy(&self.body)))
    }

    /// The sentence of a refusal.
    fn error(&self) -> String {
        self.json()["error"].as_str().unwrap().to_owned()
    }

    /// Reads on until `mark` was read, and gives all up to its end.
    fn until(&mut self, mark: &str) -> String {
        let mut text = Vec::new();
        let mut byte = [0];
        while !text.ends_with(mark.as_bytes()) {
            self.reader.read_exact(&mut byte).unwrap();
            text.push(byte[0]);
        }
        String::from_utf8_lossy(&text).into_owned()
    }
}

/// Waits until something is so that cannot tell by itself.
fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let began = Instant::now();
    while !is_so() {
        assert!(began.elapsed() < LONG, "it never was so: {what}");
        thread::park_timeout(ASKED_EVERY);
    }
}

/// Asks without reading the answer's body.
fn begin(serving: &Serving, path: &str) -> Answer {
    let mut socket = serving.connect();
    let head = format!("GET {path} HTTP/1.1\r\nHost: {}\r\n\r\n", serving.host());
    socket.write_all(head.as_bytes()).unwrap();
    Answer::head(socket)
}
