//! `relit-capture turntable` and `relit-capture simulate`, as a person types them.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use relit_rig::lockfile;
use relit_rig::turntable::Owner;
use tempfile::TempDir;

const PROGRAM: &str = env!("CARGO_BIN_EXE_relit-capture");

/// A simulator in a process of its own.
struct Simulated {
    process: Child,
    folder: TempDir,
}

impl Simulated {
    fn start(more: &[&str]) -> Simulated {
        let folder = TempDir::new().unwrap();
        let mut process = Command::new(PROGRAM)
            .args(["--json", "simulate", "--for", "600", "--link"])
            .arg(folder.path().join("table"))
            .args(more)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut ready = String::new();
        BufReader::new(process.stdout.as_mut().unwrap())
            .read_line(&mut ready)
            .unwrap();
        assert!(ready.contains("\"ready\""), "{ready}");
        Simulated { process, folder }
    }

    fn port(&self) -> PathBuf {
        self.folder.path().join("table")
    }

    fn ask(&self, words: &[&str]) -> Output {
        Command::new(PROGRAM)
            .args(["turntable", "--turntable"])
            .arg(format!("serial:{}", self.port().display()))
            .args(words)
            .output()
            .unwrap()
    }

    /// What `status` says once the table moves. The port is left alone until `owner` has it: whoever
    /// comes first owns it.
    fn status_in_motion(&self, owner: &Child) -> String {
        let folder = lockfile::standard_folder();
        for _ in 0..600 {
            std::thread::sleep(std::time::Duration::from_millis(100));
            let found = Owner::find(&self.port(), &folder).unwrap();
            if found.is_some_and(|found| found.pid() == owner.id()) {
                let status = out(&self.ask(&["status"]));
                if status.starts_with("Jog") {
                    return status;
                }
            }
        }
        panic!("the table never moved");
    }
}

impl Drop for Simulated {
    fn drop(&mut self) {
        let _gone = self.process.kill();
        let _gone = self.process.wait();
    }
}

fn out(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn err(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_table_is_looked_at_moved_and_stopped_from_the_command_line() {
    let table = Simulated::start(&["--no-reset"]);
    let status = table.ask(&["status"]);
    assert!(status.status.success(), "{}", err(&status));
    assert!(
        out(&status).starts_with("Idle, 0.000 degrees"),
        "{}",
        out(&status)
    );
    assert!(out(&status).contains("battery 12.0"), "{}", out(&status));
    let jogged = table.ask(&["jog", "-12.5", "--speed", "20"]);
    assert!(jogged.status.success(), "{}", err(&jogged));
    assert!(out(&jogged).contains("-12.499 degrees"), "{}", out(&jogged));
    let home = table.ask(&["home"]);
    assert!(home.status.success(), "{}", err(&home));
    assert!(
        err(&home).contains("where the table stands"),
        "{}",
        err(&home)
    );
    let json = table.ask(&["status", "--json"]);
    let value: serde_json::Value = serde_json::from_str(&out(&json)).unwrap();
    assert_eq!(value["event"], "status");
    assert_eq!(value["state"], "idle");
}

#[test]
fn a_second_program_reaches_a_moving_table_through_its_owner() {
    let table = Simulated::start(&[]);
    let mut jog = Command::new(PROGRAM)
        .args(["turntable", "--turntable"])
        .arg(format!("serial:{}", table.port().display()))
        .args(["jog", "300", "--speed", "10"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    assert!(table.status_in_motion(&jog).contains("degrees/s"));
    let refused = table.ask(&["jog", "5"]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(
        err(&refused).contains(&format!("process {}", jog.id())),
        "{}",
        err(&refused)
    );
    let stopped = table.ask(&["stop"]);
    assert!(stopped.status.success(), "{}", err(&stopped));
    assert!(out(&stopped).starts_with("Idle"), "{}", out(&stopped));
    assert_eq!(jog.wait().unwrap().code(), Some(1));
}

#[test]
fn what_is_wrong_is_said_in_a_sentence() {
    let nothing = Command::new(PROGRAM)
        .args([
            "turntable",
            "--turntable",
            "serial:/dev/nothing-here",
            "status",
        ])
        .output()
        .unwrap();
    assert_eq!(nothing.status.code(), Some(1));
    assert!(
        err(&nothing).contains("/dev/nothing-here"),
        "{}",
        err(&nothing)
    );
    let fault = Command::new(PROGRAM)
        .args(["simulate", "--fault", "gremlins=1", "--for", "1"])
        .output()
        .unwrap();
    assert_eq!(fault.status.code(), Some(1));
    assert!(err(&fault).contains("gremlins"), "{}", err(&fault));
    let address = Command::new(PROGRAM)
        .args(["turntable", "--turntable", "usb:3", "status"])
        .output()
        .unwrap();
    assert_eq!(address.status.code(), Some(2));
}

#[test]
fn a_jog_that_is_interrupted_stops_the_table() {
    let table = Simulated::start(&["--no-reset"]);
    let mut jog = Command::new(PROGRAM)
        .args(["turntable", "--turntable"])
        .arg(format!("serial:{}", table.port().display()))
        .args(["jog", "300", "--speed", "10"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    table.status_in_motion(&jog);
    let interrupted = Command::new("kill")
        .args(["-INT", &jog.id().to_string()])
        .status()
        .unwrap();
    assert!(interrupted.success());
    assert_eq!(jog.wait().unwrap().code(), Some(1));
    let first = out(&table.ask(&["status"]));
    let second = out(&table.ask(&["status"]));
    assert!(first.starts_with("Idle"), "{first}");
    assert_eq!(first, second);
}

/// Sends a line to the controller behind a port, as any serial terminal would, and waits for its `ok`.
fn type_in(port: &std::path::Path, line: &str) {
    let settings = serialport::new(port.display().to_string(), 115_200);
    let mut port = settings.timeout(Duration::from_secs(300)).open().unwrap();
    let mut heard = String::new();
    let mut until = |words: &str, port: &mut dyn Read| {
        let mut byte = [0];
        while !heard.ends_with(words) {
            port.read_exact(&mut byte).unwrap();
            heard.push(char::from(byte[0]));
        }
    };
    // Opening the port has reset the controller.
    until("[reset: external]\r\n", &mut port);
    port.write_all(format!("{line}\n").as_bytes()).unwrap();
    until("ok\r\n", &mut port);
}

#[test]
fn where_each_opening_resets_and_locks_the_controller_a_jog_can_home_first() {
    let table = Simulated::start(&["--index-at", "3"]);
    type_in(&table.port(), "$22=1");
    let home = table.ask(&["home"]);
    assert!(home.status.success(), "{}", err(&home));
    let locked = table.ask(&["jog", "5"]);
    assert_eq!(locked.status.code(), Some(1));
    assert!(err(&locked).contains("locked"), "{}", err(&locked));
    let jogged = table.ask(&["jog", "--home", "5"]);
    assert!(jogged.status.success(), "{}", err(&jogged));
    let said = out(&jogged);
    let last = said.lines().last().unwrap();
    assert!(
        last.starts_with("Idle, 5.00") || last.starts_with("Idle, 4.99"),
        "{said}"
    );
    assert!(!last.contains("not homed"), "{said}");
}

#[test]
fn a_moving_table_that_nobody_has_is_stopped_and_that_is_said() {
    let table = Simulated::start(&["--no-reset"]);
    let mut jog = Command::new(PROGRAM)
        .args(["turntable", "--turntable"])
        .arg(format!("serial:{}", table.port().display()))
        .args(["jog", "390", "--speed", "5"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    table.status_in_motion(&jog);
    jog.kill().unwrap();
    jog.wait().unwrap();
    let status = table.ask(&["status"]);
    assert!(out(&status).starts_with("Idle"), "{}", out(&status));
    assert!(err(&status).contains("it was stopped"), "{}", err(&status));
    let again = table.ask(&["status"]);
    assert_eq!(err(&again), "");
}

#[test]
fn what_is_no_angle_is_refused_in_words() {
    for words in [["jog", "abc"], ["jog", "inf"]] {
        let refused = Command::new(PROGRAM)
            .arg("turntable")
            .args(words)
            .output()
            .unwrap();
        assert_eq!(refused.status.code(), Some(2));
        let said = err(&refused);
        assert!(said.contains("give degrees as a number"), "{said}");
    }
}
