//! Programs that are killed while they record, and what their sessions hold then.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Duration;

use relit_capture::capture::recover;
use relit_data::clock::Clock;
use relit_data::session::{FrameEntry, Recording, Status, recordings};
use relit_data::shard::{Dataset, ImageSize};
use relit_extract::{ExtractOptions, extract};

use crate::support::{Rehearsal, SHORT, fixture};
use rustix::process::{Pid, Signal, kill_process};

/// Frames of the turns that are recorded here at 36 degrees/s.
const FRAMES: usize = 300;

/// Different numbers at each call of a test.
fn random() -> impl Iterator<Item = u64> {
    let seed = u64::from(std::process::id()) ^ Clock::monotonic().now_us() as u64;
    let next = |state: &u64| {
        let state = state.wrapping_mul(6_364_136_223_846_793_005);
        Some(state.wrapping_add(1))
    };
    std::iter::successors(Some(seed), next).map(|state| state >> 33)
}

/// The one session in a folder, and its entries.
fn only_session(root: &Path) -> (Recording, Vec<FrameEntry>) {
    let found = recordings(root).unwrap();
    assert_eq!(found.len(), 1);
    let recording = Recording::open(&found[0]).unwrap();
    let entries = recording.frames.as_ref().unwrap().entries().to_vec();
    (recording, entries)
}

/// Records a turn with the program, ends it by `signal` so many milliseconds after the table began to
/// turn back, and checks that the take is whole.
fn end_while_it_turns_back(signal: Signal, milliseconds: u64) {
    let root = tempfile::tempdir().unwrap();
    let camera = format!("replay:{}?loop=1", fixture(SHORT).display());
    let mut child = Command::new(relit_tests::program("relit-capture"))
        .args([
            "record", "--yes", "--json", "--object", "mug", "--camera", &camera,
        ])
        .args([
            "--degrees-per-second",
            "36",
            "--turntable",
            "sim:?speed=20",
            "--root",
        ])
        .arg(root.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert!(lines.any(|line| line.unwrap().contains("\"unwinding\"")));
    thread::sleep(Duration::from_millis(milliseconds));
    end(&mut child, signal);
    assert!(recover(root.path()).unwrap().is_empty());
    let (recording, entries) = only_session(root.path());
    assert_eq!(recording.manifest.unwrap().status, Status::Complete);
    assert_eq!(entries.len(), FRAMES);
    assert!(entries.iter().all(|entry| entry.angle_deg.is_some()));
}

fn end(child: &mut Child, signal: Signal) {
    // It may have ended by itself.
    let _ = kill_process(Pid::from_child(child), signal);
    child.wait().unwrap();
}

#[test]
fn a_program_that_ends_while_the_table_turns_back_leaves_a_whole_take() {
    for (signal, milliseconds) in [Signal::KILL, Signal::TERM].into_iter().zip(random()) {
        end_while_it_turns_back(signal, milliseconds % 600);
    }
}

/// `cargo test --test rehearsal -- --ignored --nocapture thirty`
#[test]
#[ignore = "takes minutes"]
fn thirty_programs_that_end_while_the_table_turns_back_leave_whole_takes() {
    for (n, at) in random().take(30).enumerate() {
        let signal = [Signal::KILL, Signal::TERM][n % 2];
        end_while_it_turns_back(signal, at % 600);
    }
}

/// Between two lines about where the table is, on its own time.
const TOLD_EVERY: Duration = Duration::from_millis(20);

#[test]
#[ignore = "run by the tests that kill it in a turn"]
fn child_that_turns_until_it_is_killed() {
    let root = PathBuf::from(std::env::var("RELIT_TEST_ROOT").unwrap());
    let frames: u64 = std::env::var("RELIT_TEST_FRAMES").unwrap().parse().unwrap();
    let mut rig = Rehearsal::whole(SHORT, "").in_folder(&root);
    let clock = rig.equipment.clock();
    let (table, monitor) = (
        rig.equipment.simulator().unwrap().clone(),
        rig.monitor.clone(),
    );
    clock.clone().scope(|scope| {
        let truth = scope.spawn("truth", || {
            let mut enough = false;
            loop {
                let t_us = clock.now_us();
                println!("TRUTH {t_us} {}", table.angle_at(t_us));
                if enough {
                    // No time passes on the rig's clock while this thread takes part in it and does not
                    // wait on it: the turn stands still until the program is killed.
                    println!("ENOUGH");
                    loop {
                        thread::park();
                    }
                }
                enough = monitor.state().frames >= frames;
                clock.sleep(TOLD_EVERY);
            }
        });
        truth.unwrap();
        rig.capture().unwrap();
    });
}

/// Where a table was, by time.
struct Truth(Vec<(i64, f64)>);

impl Truth {
    fn angle_at(&self, t_us: i64) -> f64 {
        let after = self.0.partition_point(|(at, _)| *at < t_us);
        let ((t0, a0), (t1, a1)) = (self.0[after - 1], self.0[after]);
        a0 + (a1 - a0) * (t_us - t0) as f64 / (t1 - t0) as f64
    }
}

/// The frames after which a recorder is killed at the latest. The turn has 1500, of which 256 may wait to be written: the
/// turn would be over.
const MAX_WRITTEN: u64 = 1200;

/// Kills a recorder in its turn once so many frames are written; returns the largest error of the angles that
/// its session has, degrees.
fn kill_in_the_turn(frames: u64) -> f64 {
    let root = tempfile::tempdir().unwrap();
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--ignored", "--exact", "--nocapture"])
        .arg("killed::child_that_turns_until_it_is_killed")
        .env("RELIT_TEST_ROOT", root.path())
        .env("RELIT_TEST_FRAMES", frames.to_string())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut truth = Truth(Vec::new());
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let enough = lines.any(|line| {
        let line = line.unwrap();
        let words = line
            .strip_prefix("TRUTH ")
            .and_then(|words| words.split_once(' '));
        if let Some((t_us, angle)) = words {
            let told = (t_us.parse().unwrap(), angle.parse().unwrap());
            truth.0.push(told);
        }
        line == "ENOUGH"
    });
    assert!(enough, "the turn ended before so many frames were written");
    end(&mut child, Signal::KILL);
    assert_eq!(recover(root.path()).unwrap().len(), 1);
    let (recording, entries) = only_session(root.path());
    let known: Vec<_> = entries
        .iter()
        .filter_map(|entry| Some((entry.t_us, entry.angle_deg?)))
        .collect();
    // Nothing is known of the time after the last report that reached the disk.
    assert!(
        known.len() + 15 >= entries.len(),
        "{} of {}",
        known.len(),
        entries.len()
    );
    extract_part(&recording, root.path(), known.len());
    let error = |&(t_us, angle): &(i64, f64)| (angle - truth.angle_at(t_us)).abs();
    known.iter().map(error).fold(0.0, f64::max)
}

/// Extracts part of a turn: not without being asked to, and then only the angles that there are.
fn extract_part(recording: &Recording, root: &Path, known: usize) {
    let mut options = ExtractOptions {
        size: ImageSize::Pixels(32),
        mask: Some(fixture(SHORT).join("mask_gt.png")),
        threads: 2,
        ..ExtractOptions::default()
    };
    let folder = [recording.folder.clone().unwrap()];
    let out = root.join("out");
    let tally = extract(&folder, &out, &options, &()).unwrap();
    assert_eq!((tally.extracted, tally.left_out, tally.failed), (0, 1, 0));
    options.partial = true;
    let tally = extract(&folder, &out, &options, &()).unwrap();
    assert_eq!((tally.extracted, tally.left_out), (1, 0));
    let dataset = Dataset::read(&out).unwrap();
    let entry = &dataset.sessions[0];
    assert_eq!((entry.samples as usize, entry.duplicates), (known, 0));
    assert!(entry.covered_deg.is_some());
    let report = relit_data::shard::verify(&out, &|_, _| {}).unwrap();
    assert!(report.problems.is_empty(), "{:?}", report.problems);
}

#[test]
fn a_session_that_was_killed_in_its_turn_has_the_angles_that_the_table_had() {
    for (at, most) in random().zip([140, MAX_WRITTEN]) {
        let error = kill_in_the_turn(40 + at % (most - 40));
        assert!(error <= 0.05, "{error} degrees");
    }
}

/// `cargo test --test rehearsal -- --ignored --nocapture thirty`
#[test]
#[ignore = "takes minutes"]
fn thirty_sessions_that_were_killed_in_their_turn_have_the_angles_that_the_table_had() {
    let errors = random()
        .take(30)
        .map(|at| kill_in_the_turn(20 + at % (MAX_WRITTEN - 20)));
    let worst = errors.fold(0.0, f64::max);
    println!("largest error: {worst:.4} degrees");
    assert!(worst <= 0.05, "{worst} degrees");
}
