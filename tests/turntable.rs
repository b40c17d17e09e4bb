//! The table's driver against the firmware's core: the two sides of the serial line share no code
//! and meet at a pseudoterminal, on a clock that runs ahead.

#![allow(clippy::unwrap_used, reason = "a test's own mistakes should be loud")]
#![allow(clippy::print_stdout, reason = "the figures are worth reading")]

use relit::clock::Clock;
use relit::simulator::{Simulator, SimulatorOptions};
use relit::turntable::{Fault, Options, State, Table, TurnPlan, TurnRequest, TurntableError};

/// A simulated table and its driver.
struct Rig {
    table: Table,
    simulator: Simulator,
    clock: Clock,
    _folder: tempfile::TempDir,
}

fn open(speed: f64, faults: &str) -> Result<Rig, TurntableError> {
    open_with(speed, faults, true)
}

fn open_with(speed: f64, faults: &str, extras: bool) -> Result<Rig, TurntableError> {
    let clock = Clock::scaled(speed);
    let options = SimulatorOptions {
        clock,
        faults: faults.parse().unwrap(),
        drift_ppm: 1500.0,
        ..SimulatorOptions::default()
    };
    let simulator = Simulator::start(options).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let options = Options {
        clock,
        runtime_folder: folder.path().to_owned(),
        extras,
        ..Options::default()
    };
    let table = Table::open_serial(simulator.path(), &options)?;
    Ok(Rig {
        table,
        simulator,
        clock,
        _folder: folder,
    })
}

impl Rig {
    fn truth(&self) -> f64 {
        self.simulator.angle_at(self.clock.now_us())
    }

    fn plan(&self) -> TurnPlan {
        let status = self.table.status().unwrap();
        TurnPlan::new(self.table.identity(), &status, &TurnRequest::default()).unwrap()
    }
}

/// Errors of the told angle at every frame of a turn, in order of size.
fn turn_errors(rig: &Rig) -> Vec<f64> {
    rig.table.home().unwrap();
    let mut turn = rig.table.start_turn(rig.plan()).unwrap();
    turn.wait_constant().unwrap();
    let track = turn.wait_end().unwrap();
    let (from_us, to_us) = track.constant_us();
    let frames = (from_us..=to_us).step_by(33_333);
    let off = |t_us| (track.angle_at(t_us).unwrap() - rig.simulator.angle_at(t_us)).abs();
    let mut off: Vec<f64> = frames.map(off).collect();
    off.sort_by(f64::total_cmp);
    let at = |part: usize| off[(off.len() - 1) * part / 100];
    println!(
        "{} frames: median {:.4} deg, p99 {:.4}, max {:.4}; {} polls, {} outliers, half a round trip {:.0} us",
        off.len(),
        at(50),
        at(99),
        at(100),
        track.polls(),
        track.outliers(),
        track.half_round_trip_us()
    );
    off
}

#[test]
fn a_whole_turn_tells_the_angle_at_any_time() {
    for extras in [true, false] {
        let rig = open_with(10.0, "", extras).unwrap();
        let off = turn_errors(&rig);
        assert!(off.len() > 1500);
        assert!(off[off.len() * 99 / 100] <= 0.05);
        assert!(rig.truth().abs() < 0.02, "unwound");
    }
}

#[test]
#[ignore = "takes two minutes: the same in real time"]
fn a_whole_turn_in_real_time_tells_the_angle_at_any_time() {
    for extras in [true, false] {
        let off = turn_errors(&open_with(1.0, "", extras).unwrap());
        assert!(off[off.len() * 99 / 100] <= 0.05);
    }
}

/// Jogs to and fro on a bad wire; each ends at its place, or fails and the table stands. Gives how
/// many did and did not.
fn jog_on_a_bad_wire(rig: &Rig, jogs: u32) -> (u32, u32) {
    let (mut done, mut failed) = (0, 0);
    for number in 0..jogs {
        let before = rig.truth();
        let degrees = if before > 0.0 { -1.2 } else { 1.5 };
        match rig.table.jog(degrees, None) {
            Ok(status) => {
                assert!((rig.truth() - before - degrees).abs() < 0.03, "{status:?}");
                done += 1;
            }
            Err(error) => {
                println!("jog {number}: {error}");
                failed += 1;
                recover(rig);
            }
        }
    }
    println!("{done} done, {failed} failed, {:?}", rig.table.counts());
    (done, failed)
}

const BAD_WIRE: &str = "drop=0.0005,flip=0.0005,duplicate=0.02,merge=0.02,delay=0.001:30ms";

#[test]
fn on_a_bad_wire_each_jog_is_made_once_or_fails_and_the_table_stands() {
    let (done, failed) = jog_on_a_bad_wire(&open(20.0, BAD_WIRE).unwrap(), 60);
    assert!(done > failed);
}

#[test]
#[ignore = "takes minutes: a hundred thousand questions and answers"]
fn a_hundred_thousand_exchanges_make_no_wrong_move() {
    for extras in [true, false] {
        let rig = open_with(40.0, BAD_WIRE, extras).unwrap();
        while rig.table.counts().reports + rig.table.counts().lines < 100_000 {
            jog_on_a_bad_wire(&rig, 500);
        }
    }
}

/// Brings the table back to where it takes motions, as a person would, and sees that it stands.
fn recover(rig: &Rig) {
    for _ in 0..20 {
        let stopped = rig.table.stop();
        let locked = |state| matches!(state, State::Alarm);
        if stopped.is_ok_and(|status| !locked(status.state) || rig.table.unlock().is_ok()) {
            let place = rig.truth();
            rig.clock.sleep(std::time::Duration::from_millis(300));
            assert_eq!(rig.truth(), place);
            return;
        }
    }
    unreachable!("the table cannot be brought to rest");
}

#[test]
fn a_chip_that_restarts_in_a_turn_ends_it_with_that_reason() {
    let rig = open(10.0, "reset@20s").unwrap();
    rig.table.home().unwrap();
    let turn = rig.table.start_turn(rig.plan()).unwrap();
    let error = turn.wait_end().unwrap_err();
    let restarted = matches!(error, TurntableError::Motion(Fault::Restarted(_)));
    assert!(restarted, "{error}");
    assert!(!rig.table.status().unwrap().homed);
}
