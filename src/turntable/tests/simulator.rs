//! The simulated table, as a program at its port sees it.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a panic is how a test reports"
)]

use std::io::{Read, Write};
use std::path::Path;
use std::time::{Duration, Instant};

use relit_data::clock::{Clock, Participant};
use relit_turntable::Port;
use relit_turntable::simulator::{
    STEPS_PER_TURN, SimulatedPort, SimulatedTable, Simulator, SimulatorOptions,
};
use serialport::TTYPort;

/// The longest that anything takes on the table's clock.
const MAX_WAIT: Duration = Duration::from_secs(120);

/// A simulated table on virtual time and a host at its port.
struct Bench {
    table: SimulatedTable,
    clock: Clock,
    port: SimulatedPort,
    heard: String,
    _participant: Participant,
}

impl Bench {
    fn new(options: SimulatorOptions) -> Bench {
        let clock = Clock::virtual_time();
        let participant = clock.participate();
        let table = SimulatedTable::new(&SimulatorOptions {
            clock: clock.clone(),
            ..options
        });
        Bench {
            port: table.open(),
            table,
            clock,
            heard: String::new(),
            _participant: participant,
        }
    }

    /// A table whose chip has started.
    fn ready(options: SimulatorOptions) -> Bench {
        let mut bench = Bench::new(options);
        bench.until("external]\r\n");
        bench
    }

    fn say(&mut self, text: &str) {
        self.port.write(text.as_bytes()).unwrap();
    }

    /// Listens until the table says this, and gives what it said up to there.
    fn until(&mut self, text: &str) -> String {
        let end_us = self.clock.after(MAX_WAIT);
        while self.clock.now_us() < end_us {
            if let Some(at) = self.heard.find(text) {
                let rest = self.heard.split_off(at + text.len());
                return std::mem::replace(&mut self.heard, rest);
            }
            self.listen(Duration::from_millis(5));
        }
        panic!("never {text:?}, but {:?}", self.heard);
    }

    /// Takes what comes within this time.
    fn listen(&mut self, wait: Duration) {
        let mut buffer = [0; 256];
        let end_us = self.clock.after(wait);
        while self.clock.now_us() < end_us {
            let count = self.port.read(&mut buffer, wait).unwrap();
            self.heard += &String::from_utf8_lossy(&buffer[..count]);
        }
    }

    fn ask(&mut self, line: &str) -> String {
        self.say(&format!("{line}\n"));
        self.until("ok\r\n")
    }

    /// Asks for status reports until one begins like this.
    fn wait(&mut self, state: &str) -> String {
        let end_us = self.clock.after(MAX_WAIT);
        while self.clock.now_us() < end_us {
            self.say("?");
            let report = self.until(">\r\n");
            if report.starts_with(&format!("<{state}")) {
                return report;
            }
            self.clock.sleep(Duration::from_millis(50));
        }
        panic!("never {state}");
    }
}

#[test]
fn whoever_opens_the_port_resets_the_chip() {
    let mut bench = Bench::ready(SimulatorOptions::default());
    bench.ask("G0 X1");
    bench.wait("Idle");
    bench.port = bench.table.open();
    bench.until("[reset: external]\r\n");
    assert!(bench.wait("Idle").contains("MPos:0.000"));
}

#[test]
fn a_turn_has_all_its_steps() {
    let mut bench = Bench::ready(SimulatorOptions::default());
    bench.ask("G1 X360 F432");
    bench.wait("Idle");
    let edges = bench.table.edges();
    assert_eq!(edges.last().unwrap().steps, STEPS_PER_TURN as i64);
    let end = edges.last().unwrap().t_us;
    assert!((bench.table.angle_at(end) - 360.0).abs() < 1e-9);
    let (first, last) = (edges[100], edges[edges.len() - 100]);
    let speed = (last.steps - first.steps) as f64 / (last.t_us - first.t_us) as f64 * 1e6;
    assert!((speed - 640.0).abs() < 0.01, "{speed}");
}

#[test]
fn a_report_and_the_truth_agree() {
    let mut bench = Bench::ready(SimulatorOptions::default());
    let started = bench.clock.now_us();
    bench.ask("G1 X180 F432");
    bench.clock.sleep(Duration::from_secs(2));
    for _ in 0..20 {
        let before = bench.clock.now_us();
        let report = bench.wait("Run");
        let after = bench.clock.now_us();
        let angle = report.split(['|', ':', ',']).nth(2).unwrap();
        let angle: f64 = angle.parse().unwrap();
        assert!(angle >= bench.table.angle_at(before) - 0.02);
        assert!(angle <= bench.table.angle_at(after) + 0.02);
        assert!(before > started);
    }
}

#[test]
fn homing_finds_the_index_at_its_angle() {
    let mut bench = Bench::ready(SimulatorOptions {
        start_angle: 100.0,
        index_at: 130.0,
        ..SimulatorOptions::default()
    });
    bench.ask("$22=1");
    bench.ask("$H");
    assert!(bench.wait("Idle").contains("MPos:0.000"));
    let angle = bench.table.angle_at(bench.clock.now_us());
    let step = 360.0 / STEPS_PER_TURN;
    assert!((angle - 130.0).abs() <= step, "{angle}");
}

#[test]
fn pins_can_be_driven() {
    let mut bench = Bench::ready(SimulatorOptions::default());
    bench.table.hold_index(Some(true));
    bench.table.set_battery(11.84);
    bench.clock.sleep(Duration::from_millis(500));
    let report = bench.wait("Idle");
    assert!(report.contains("|Bat:11.8"), "{report}");
    assert!(report.contains("|Pn:X"), "{report}");
    bench.table.hold_index(None);
    bench.ask("G1 X90 F432");
    bench.table.press_emergency_stop(true);
    bench.until("ALARM:10\r\n");
    let edges = bench.table.edges().len();
    bench.clock.sleep(Duration::from_secs(1));
    assert_eq!(bench.table.edges().len(), edges);
}

#[test]
fn a_reset_in_a_turn_shows_its_banner() {
    let mut bench = Bench::ready(SimulatorOptions {
        faults: "reset@6s".parse().unwrap(),
        ..SimulatorOptions::default()
    });
    bench.ask("G1 X360 F432");
    bench.until("[reset: watchdog]\r\n");
}

#[test]
fn a_stalled_chip_neither_answers_nor_moves() {
    let mut bench = Bench::ready(SimulatorOptions {
        faults: "stall@6s".parse().unwrap(),
        ..SimulatorOptions::default()
    });
    bench.ask("G1 X360 F432");
    bench.listen(Duration::from_secs(6));
    bench.heard.clear();
    let edges = bench.table.edges().len();
    assert!(edges > 0);
    bench.say("?\n");
    bench.listen(Duration::from_secs(3));
    assert_eq!(bench.heard, "");
    assert_eq!(bench.table.edges().len(), edges);
}

#[test]
fn a_crystal_that_goes_wrong_shows_in_the_speed() {
    let mut bench = Bench::ready(SimulatorOptions {
        drift_ppm: 5000.0,
        ..SimulatorOptions::default()
    });
    bench.ask("G1 X90 F432");
    bench.wait("Idle");
    let edges = bench.table.edges();
    let (first, last) = (edges[100], edges[edges.len() - 100]);
    let speed = (last.steps - first.steps) as f64 / (last.t_us - first.t_us) as f64 * 1e6;
    assert!((speed - 640.0 * 1.005).abs() < 0.01, "{speed}");
}

#[test]
fn at_a_pseudoterminal_any_program_reaches_the_table() {
    let table = Simulator::start(&SimulatorOptions::default(), None).unwrap();
    let mut port = open(table.path());
    let heard = hear(&mut port, "external]\r\n");
    assert!(heard.contains("Grbl 1.1h"), "{heard}");
    port.write_all(b"?").unwrap();
    let report = hear(&mut port, ">\r\n");
    assert!(report.contains("MPos:0.000"), "{report}");
    drop(port);
    hear(&mut open(table.path()), "external]\r\n");
}

fn open(path: &Path) -> TTYPort {
    let port = serialport::new(path.to_string_lossy(), 115_200);
    TTYPort::open(&port.timeout(Duration::from_millis(5))).unwrap()
}

/// Listens until the table has said this.
fn hear(port: &mut TTYPort, text: &str) -> String {
    let (mut heard, mut buffer) = (String::new(), [0; 256]);
    let end = Instant::now() + Duration::from_secs(300);
    while !heard.contains(text) {
        assert!(Instant::now() < end, "never {text:?}, but {heard:?}");
        let count = port.read(&mut buffer).unwrap_or(0);
        heard += &String::from_utf8_lossy(&buffer[..count]);
    }
    heard
}

#[test]
fn the_second_name_lives_as_long_as_the_table() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("table");
    std::os::unix::fs::symlink("/nowhere", &link).unwrap();
    let start = || Simulator::start(&SimulatorOptions::default(), Some(&link));
    let table = start().unwrap();
    assert_eq!(std::fs::read_link(&link).unwrap(), table.path());
    let mut port = open(&link);
    port.write_all(b"\n").unwrap();
    drop(table);
    assert!(std::fs::read_link(&link).is_err());
    std::fs::write(&link, "somebody's file").unwrap();
    assert!(start().is_err());
    assert_eq!(std::fs::read_to_string(&link).unwrap(), "somebody's file");
}
