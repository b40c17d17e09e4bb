//! `relit-capture turntable` and `relit-capture simulate`, as a person types them.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use relit_turntable::simulator::{Simulator, SimulatorOptions};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use tempfile::TempDir;

const PROGRAM: &str = env!("CARGO_BIN_EXE_relit-capture");

/// A simulated table at a port that programs open.
struct Simulated {
    simulator: Simulator,
    folder: TempDir,
}

impl Simulated {
    fn start(options: &SimulatorOptions) -> Simulated {
        let folder = TempDir::new().unwrap();
        let link = folder.path().join("table");
        let simulator = Simulator::start(options, Some(&link)).unwrap();
        Simulated { simulator, folder }
    }

    /// One that opening does not reset.
    fn without_reset() -> Simulated {
        Simulated::start(&SimulatorOptions {
            reset_on_open: false,
            ..SimulatorOptions::default()
        })
    }

    fn port(&self) -> PathBuf {
        self.folder.path().join("table")
    }

    fn ask(&self, words: &[&str]) -> Output {
        ask(&self.port(), words)
    }

    /// Starts a jog in its own process, and waits until the table moves.
    fn jog(&self, words: &[&str]) -> Child {
        let mut jog = Command::new(PROGRAM)
            .args(["turntable", "--turntable"])
            .arg(format!("serial:{}", self.port().display()))
            .arg("jog")
            .args(words)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // As long as a machine takes that is busy with something else.
        for _ in 0..3000 {
            if self.simulator.table().edges().len() > 100 {
                return jog;
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        jog.kill().unwrap();
        jog.wait().unwrap();
        panic!("the table never moved");
    }
}

fn ask(port: &Path, words: &[&str]) -> Output {
    Command::new(PROGRAM)
        .args(["turntable", "--turntable"])
        .arg(format!("serial:{}", port.display()))
        .args(words)
        .output()
        .unwrap()
}

/// A simulator in its own process, until it is dropped.
struct Program(Child);

impl Drop for Program {
    fn drop(&mut self) {
        let _gone = self.0.kill();
        let _gone = self.0.wait();
    }
}

fn out(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The event that a command with `--json` printed.
#[track_caller]
fn event(output: &Output) -> Value {
    assert!(output.status.success(), "{}", err(output));
    let printed = out(output);
    serde_json::from_str(printed.lines().last().unwrap()).unwrap()
}

fn err(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_table_is_looked_at_moved_and_stopped_from_the_command_line() {
    let folder = TempDir::new().unwrap();
    let port = folder.path().join("table");
    let process = Command::new(PROGRAM)
        .args(["--json", "simulate", "--link"])
        .arg(&port)
        .stdout(Stdio::piped())
        .spawn();
    let mut program = Program(process.unwrap());
    let mut ready = String::new();
    BufReader::new(program.0.stdout.as_mut().unwrap())
        .read_line(&mut ready)
        .unwrap();
    let ready: Value = serde_json::from_str(&ready).unwrap();
    assert_eq!(ready["event"], "ready");
    let status = event(&ask(&port, &["status", "--json"]));
    assert_eq!(status["event"], "status");
    assert_eq!(
        (&status["state"], &status["angle_deg"]),
        (&"idle".into(), &0.0.into())
    );
    let volts = status["battery_v"].as_f64().unwrap();
    assert!((volts - 12.0).abs() < 0.1, "{volts}");
    let jogged = event(&ask(&port, &["jog", "-12.5", "--speed", "20", "--json"]));
    let angle = jogged["angle_deg"].as_f64().unwrap();
    assert!((angle + 12.499).abs() < 6e-4, "{angle}");
    let home = ask(&port, &["home", "--json"]);
    assert_eq!(event(&home)["event"], "homed");
    // Zero is where it stands, as it has no index: a person is told.
    assert!(err(&home).contains("$22=0"), "{}", err(&home));
    // The same for a person.
    let status = ask(&port, &["status"]);
    assert!(out(&status).contains("Idle"), "{}", out(&status));
}

#[test]
fn a_second_program_is_told_who_has_the_table_and_a_stop_ends_that_one() {
    let table = Simulated::start(&SimulatorOptions::default());
    let mut jog = table.jog(&["300", "--speed", "10"]);
    for words in [&["jog", "5"][..], &["status"]] {
        let refused = table.ask(words);
        assert_eq!(refused.status.code(), Some(1));
        assert!(
            err(&refused).contains(&jog.id().to_string()),
            "{}",
            err(&refused)
        );
    }
    let stopped = event(&table.ask(&["stop", "--json"]));
    assert_eq!(
        (&stopped["event"], &stopped["state"]),
        (&"stopped".into(), &"idle".into())
    );
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
        .args(["simulate", "--fault", "gremlins=1"])
        .output()
        .unwrap();
    assert_eq!(fault.status.code(), Some(2));
    assert!(err(&fault).contains("gremlins"), "{}", err(&fault));
    let address = Command::new(PROGRAM)
        .args(["turntable", "--turntable", "usb:3", "status"])
        .output()
        .unwrap();
    assert_eq!(address.status.code(), Some(2));
}

#[test]
fn a_jog_that_is_interrupted_stops_the_table() {
    let table = Simulated::without_reset();
    let mut jog = table.jog(&["300", "--speed", "10"]);
    kill_process(Pid::from_child(&jog), Signal::INT).unwrap();
    assert_eq!(jog.wait().unwrap().code(), Some(1));
    let first = event(&table.ask(&["status", "--json"]));
    let second = event(&table.ask(&["status", "--json"]));
    assert_eq!(first["state"], "idle", "{first}");
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
    let table = Simulated::start(&SimulatorOptions {
        index_at: 3.0,
        ..SimulatorOptions::default()
    });
    type_in(&table.port(), "$22=1");
    let home = table.ask(&["home"]);
    assert!(home.status.success(), "{}", err(&home));
    let locked = table.ask(&["jog", "5"]);
    assert_eq!(locked.status.code(), Some(1));
    assert!(err(&locked).contains("Alarm"), "{}", err(&locked));
    let jogged = event(&table.ask(&["jog", "--home", "5", "--json"]));
    assert_eq!(
        (&jogged["state"], &jogged["homed"]),
        (&"idle".into(), &true.into())
    );
    let angle = jogged["angle_deg"].as_f64().unwrap();
    assert!((angle - 5.0).abs() < 0.01, "{angle}");
}

#[test]
fn a_moving_table_that_nobody_has_is_stopped_and_that_is_said() {
    let table = Simulated::without_reset();
    let mut jog = table.jog(&["390", "--speed", "5"]);
    jog.kill().unwrap();
    jog.wait().unwrap();
    let status = table.ask(&["status", "--json"]);
    assert_eq!(event(&status)["state"], "idle");
    assert!(
        out(&status).contains(r#""event":"warning""#),
        "{}",
        out(&status)
    );
    assert_eq!(err(&status).lines().count(), 1, "{}", err(&status));
    let again = table.ask(&["status", "--json"]);
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
        assert!(said.contains(words[1]), "{said}");
    }
}
