//! Many small motions over a bad line: none wrong, none doubled.
//!
//! The ordinary tests do a few thousand. The long run, with its figures:
//! `cargo test --release --test turntable a_hundred_thousand -- --ignored --nocapture`

use proptest::prelude::Rng;
use proptest::test_runner::{RngAlgorithm, TestRng};
use relit_turntable::simulator::SerialFaults;
use relit_turntable::{ControllerState, Table, TurntableError};

use crate::rig::{Rig, STEP_DEG};

/// How a run over a bad line came out.
#[derive(Debug, Default)]
struct Outcome {
    exchanges: u64,
    /// Those with tables that were closed since.
    past: u64,
    moves: u64,
    done: u64,
    stopped: u64,
    repeats: u64,
    noise: u64,
    reopened: u64,
    wrong: Vec<String>,
}

/// Jogs to and fro until `exchanges` lines and reports went over the line, and compares the true
/// angle with what the host was told after each.
fn run(rig: &Rig, exchanges: u64, seed: u8) -> Outcome {
    let mut outcome = Outcome::default();
    let mut random = TestRng::from_seed(RngAlgorithm::ChaCha, &[seed; 32]);
    let mut table = rig.open();
    while outcome.exchanges < exchanges {
        let before = rig.truth();
        let degrees = f64::from(random.next_u32() % 400) / 1000.0 - 0.2;
        let degrees = if before > 10.0 {
            -degrees.abs()
        } else {
            degrees
        };
        outcome.moves += 1;
        match table.jog(degrees, None) {
            Ok(_) => {
                outcome.done += 1;
                let off = rig.truth() - before - degrees;
                if off.abs() > 1.5 * STEP_DEG {
                    outcome
                        .wrong
                        .push(format!("{degrees} was done, off by {off}"));
                }
            }
            Err(error) => {
                outcome.stopped += 1;
                note_stop(rig, &table, before, degrees, &error, &mut outcome);
                table = recover(rig, table, &mut outcome);
            }
        }
        outcome.exchanges = outcome.past + exchanged(&table);
    }
    add_counts(&table, &mut outcome);
    outcome
}

/// After a motion that failed the table stands; where lines are checked, somewhere between where it
/// was and its target. Without checksums a line that lost a digit may have been carried out, which
/// is why the motion failed.
fn note_stop(
    rig: &Rig,
    table: &Table,
    before: f64,
    degrees: f64,
    error: &TurntableError,
    outcome: &mut Outcome,
) {
    let _stopped_or_reported = table.stop();
    let stopped = rig.truth();
    rig.options
        .clock
        .sleep(std::time::Duration::from_millis(500));
    let moved = rig.truth() - before;
    if rig.truth() != stopped {
        outcome.wrong.push(format!(
            "{degrees} failed ({error}), and it still moves after a stop"
        ));
    }
    if !rig.options.extras {
        return;
    }
    let (low, high) = (degrees.min(0.0), degrees.max(0.0));
    if moved < low - 1.5 * STEP_DEG || moved > high + 1.5 * STEP_DEG {
        outcome.wrong.push(format!(
            "{degrees} failed ({error}), and it moved by {moved}"
        ));
    }
}

fn recover(rig: &Rig, table: Table, outcome: &mut Outcome) -> Table {
    let _unlocked = table.unlock();
    let ready = table
        .status()
        .is_ok_and(|status| status.state == ControllerState::Idle);
    let probe = table.jog(0.0, None);
    if ready && !matches!(probe, Err(TurntableError::Unsent { .. })) {
        return table;
    }
    add_counts(&table, outcome);
    drop(table);
    outcome.reopened += 1;
    let mut last = None;
    for _ in 0..20 {
        match rig.try_open() {
            Ok(table) => {
                let _unlocked = table.unlock();
                return table;
            }
            Err(error) => last = Some(error),
        }
    }
    panic!("the table could not be opened again: {last:?}");
}

fn add_counts(table: &Table, outcome: &mut Outcome) {
    let counts = table.counts();
    outcome.past += counts.lines + counts.reports;
    outcome.repeats += counts.repeats;
    outcome.noise += counts.noise;
}

/// Lines that were answered, and reports.
fn exchanged(table: &Table) -> u64 {
    let counts = table.counts();
    counts.lines + counts.reports
}

fn faults() -> SerialFaults {
    SerialFaults {
        drop: 0.001,
        flip: 0.001,
        duplicate: 0.01,
        merge: 0.005,
        ..SerialFaults::default()
    }
}

#[test]
fn no_motion_is_wrong_or_doubled_over_a_bad_wire() {
    let rig = Rig::wired(faults(), 0);
    let outcome = run(&rig, 3000, 1);
    println!("{outcome:?}");
    assert!(outcome.wrong.is_empty(), "{:?}", outcome.wrong);
    assert!(outcome.done > 20, "{outcome:?}");
    assert!(outcome.repeats + outcome.noise > 0, "no fault happened");
}

#[test]
fn without_checksums_no_motion_is_wrong_or_doubled_either() {
    let rig = Rig::wired(
        SerialFaults {
            drop: 0.0005,
            flip: 0.0,
            ..faults()
        },
        0,
    )
    .plain();
    let outcome = run(&rig, 3000, 3);
    println!("{outcome:?}");
    assert!(outcome.wrong.is_empty(), "{:?}", outcome.wrong);
}

#[test]
#[ignore = "takes minutes; see the module's documentation"]
fn a_hundred_thousand_exchanges() {
    let rig = Rig::wired(faults(), 7);
    let checked = run(&rig, 100_000, 2);
    println!("checked lines: {checked:#?}");
    let rig = Rig::wired(faults(), 7).plain();
    let plain = run(&rig, 100_000, 2);
    println!("plain Grbl: {plain:#?}");
    assert!(checked.wrong.is_empty(), "{:?}", checked.wrong);
}
