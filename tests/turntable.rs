//! The table's driver against the firmware's core: the two sides of the serial line share no code
//! and meet at a pseudoterminal, on a clock that runs ahead.

#![allow(clippy::unwrap_used, reason = "a test's own mistakes should be loud")]

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

#[test]
fn a_whole_turn_tells_the_angle_at_any_time() {
    let rig = open(10.0, "").unwrap();
    rig.table.home().unwrap();
    let mut turn = rig.table.start_turn(rig.plan()).unwrap();
    turn.wait_constant().unwrap();
    let track = turn.wait_end().unwrap();
    let (from_us, to_us) = track.constant_us();
    let frames = (from_us..=to_us).step_by(33_333);
    let off = |t_us| (track.angle_at(t_us).unwrap() - rig.simulator.angle_at(t_us)).abs();
    let mut off: Vec<f64> = frames.map(off).collect();
    off.sort_by(f64::total_cmp);
    println!(
        "{} frames, median {:.4} deg, p99 {:.4}, max {:.4}; {track:?}",
        off.len(),
        off[off.len() / 2],
        off[off.len() * 99 / 100],
        off[off.len() - 1]
    );
    assert!(off.len() > 1500);
    assert!(off[off.len() * 99 / 100] <= 0.05);
    assert!(rig.truth().abs() < 0.02, "unwound");
}

#[test]
fn on_a_bad_wire_each_jog_is_made_once_or_fails_and_the_table_stands() {
    let faults = "drop=0.001,flip=0.001,duplicate=0.02,merge=0.02,delay=0.001:30ms";
    let rig = open(20.0, faults).unwrap();
    let (mut done, mut failed) = (0, 0);
    for number in 0..60 {
        let before = rig.truth();
        let degrees = if number % 2 == 0 { 1.5 } else { -1.2 };
        match rig.table.jog(degrees, None) {
            Ok(status) => {
                assert!((rig.truth() - before - degrees).abs() < 0.03, "{status:?}");
                done += 1;
            }
            Err(error) => {
                println!("jog {number}: {error}");
                failed += 1;
                recover(&rig);
            }
        }
    }
    println!("{done} done, {failed} failed, {:?}", rig.table.counts());
    assert!(done > failed);
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
