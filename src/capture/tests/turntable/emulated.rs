//! The host against the very firmware that is flashed, on an emulated chip in real time.
//!
//! Needs what `make firmware emulator` builds, and takes more than a minute of real time each:
//! `cargo test --release --test turntable angle_error -- --ignored --nocapture --test-threads 1`

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::thread;

use relit_turntable::{AngleFit, Table, TableOptions};
use tempfile::TempDir;

use crate::rig::{STEP_DEG, paper_turn, spread};

const FRAME_US: i64 = 33_333;

/// The emulated chip, its port and its record of STEP edges.
struct Chip {
    process: Child,
    _commands: ChildStdin,
    folder: TempDir,
}

impl Chip {
    fn start() -> Chip {
        let built = built();
        let folder = TempDir::new().unwrap();
        // The chip stands for hardware that no load on the host slows down; without the right to it,
        // `nice` goes on without.
        let mut process = Command::new("nice")
            .args(["-n", "-15"])
            .arg(built.join("rig-emulator"))
            .arg(built.join("rig-firmware-uno.elf"))
            .arg("--pty")
            .arg(folder.path().join("table"))
            .arg("--edges")
            .arg(folder.path().join("edges"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the emulated chip is built by `make firmware emulator`");
        let mut ready = String::new();
        BufReader::new(process.stdout.as_mut().unwrap())
            .read_line(&mut ready)
            .unwrap();
        assert!(ready.starts_with("ready"), "{ready}");
        let commands = process.stdin.take().unwrap();
        Chip {
            process,
            _commands: commands,
            folder,
        }
    }

    fn open(&self) -> Table {
        let port = self.folder.path().join("table");
        Table::open_serial(&port, &TableOptions::default()).unwrap()
    }

    /// Ends the chip; its steps: microseconds of the monotonic clock, and the angle after each.
    fn end(mut self) -> Vec<(i64, f64)> {
        drop(self._commands);
        self.process.wait().unwrap();
        let text = fs::read_to_string(self.folder.path().join("edges")).unwrap();
        let mut angle = 0.0;
        text.lines()
            .map(|line| {
                let mut words = line.split(' ').skip(1);
                // DIR is low for a positive turn.
                let forward = words.next() == Some("0");
                angle += if forward { STEP_DEG } else { -STEP_DEG };
                (words.next().unwrap().parse().unwrap(), angle)
            })
            .collect()
    }
}

/// Programs that keep every core busy.
struct Load(Vec<Child>);

impl Load {
    fn on_all_cores() -> Load {
        let cores = thread::available_parallelism().unwrap().get();
        let busy = || {
            Command::new("sh")
                .args(["-c", "while :; do :; done"])
                .spawn()
        };
        Load((0..cores).map(|_| busy().unwrap()).collect())
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        for busy in &mut self.0 {
            let _gone = busy.kill();
            let _gone = busy.wait();
        }
    }
}

fn built() -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target"),
        PathBuf::from,
    );
    target.join("firmware")
}

/// One turn of the paper; the track that the host fitted, and the chip's steps.
fn turn() -> (AngleFit, Vec<(i64, f64)>) {
    let chip = Chip::start();
    let table = chip.open();
    table.home().unwrap();
    let track = table
        .start_turn(paper_turn(&table))
        .unwrap()
        .wait_end()
        .unwrap();
    drop(table);
    (track, chip.end())
}

fn angle_of(steps: &[(i64, f64)], t_us: i64) -> f64 {
    let after = steps.partition_point(|(t, _)| *t <= t_us);
    let (t0, a0) = steps[after - 1];
    let (t1, a1) = steps[after];
    a0 + (a1 - a0) * (t_us - t0) as f64 / (t1 - t0) as f64
}

fn report(name: &str, track: &AngleFit, steps: &[(i64, f64)]) -> f64 {
    let (from, _) = track.constant_us();
    let errors = (0..1500).map(|frame| {
        let t = from + frame * FRAME_US;
        track.angle_at(t).expect("the turn has 1500 frames") - angle_of(steps, t)
    });
    let (median, p99, largest) = spread(errors);
    println!(
        "| {name} | {median:.4} | {p99:.4} | {largest:.4} | {} polls, half a round trip {:.0} us |",
        track.polls, track.half_round_trip_us
    );
    p99
}

#[test]
#[ignore = "more than a minute of real time; see the module's documentation"]
fn angle_error_against_the_step_edges() {
    println!("| host | median | p99 | largest, degrees | |");
    let (track, steps) = turn();
    let quiet = report("quiet", &track, &steps);
    let load = Load::on_all_cores();
    let (track, steps) = turn();
    drop(load);
    let loaded = report("loaded", &track, &steps);
    assert!(quiet <= 0.05, "quiet: p99 {quiet}");
    assert!(loaded <= 0.05, "loaded: p99 {loaded}");
}
