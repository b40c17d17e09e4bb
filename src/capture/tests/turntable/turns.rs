//! Whole turns against the simulated table, whose true angle is known at any moment: on virtual time,
//! and two at a pseudoterminal in real time.

use std::time::Duration;

use relit_turntable::simulator::{SerialFaults, SimulatorOptions};
use relit_turntable::{ControllerState, HomingResult, MotionFault, TurntableError};

use crate::rig::{PacedRig, Rig, STEP_DEG, paper_turn, spread, turn_by};

const FRAME_US: i64 = 33_333;

#[test]
fn every_frame_of_a_turn_gets_its_angle() {
    let p99 = turn_and_compare(&Rig::with(drifting()));
    assert!(p99 <= 0.01, "p99 {p99}");
}

#[test]
fn without_the_chips_time_every_frame_of_a_turn_gets_its_angle_too() {
    let p99 = turn_and_compare(&Rig::with(drifting()).plain());
    assert!(p99 <= 0.01, "p99 {p99}");
}

/// A table whose chip has a ceramic resonator: 1500 parts in a million off.
fn drifting() -> SimulatorOptions {
    SimulatorOptions {
        drift_ppm: 1500.0,
        ..SimulatorOptions::default()
    }
}

/// Turns once, and gives the 99th percentile of the angle's error over the frames of the turn.
fn turn_and_compare(rig: &Rig) -> f64 {
    let table = rig.open();
    assert_eq!(table.home().unwrap(), HomingResult::WhereItStands);
    let zero = rig.truth();
    let turn = table.start_turn(paper_turn(&table)).unwrap();
    let track = turn.wait_end().unwrap();
    let (from, to) = track.constant_us();
    let turned = track.angle_at(to).unwrap() - track.angle_at(from).unwrap();
    assert!(turned.abs() >= 360.0, "{turned}");
    let errors: Vec<f64> = (0..1500)
        .map(|frame| from + frame * FRAME_US)
        .filter_map(|t| Some(track.angle_at(t)? - (rig.simulated.angle_at(t) - zero)))
        .collect();
    assert_eq!(errors.len(), 1500);
    let (median, p99, largest) = spread(errors);
    println!(
        "angle error, degrees: median {median:.4}, p99 {p99:.4}, largest {largest:.4}; {} polls, \
         half a round trip {:.0} us",
        track.polls, track.half_round_trip_us
    );
    assert!((rig.truth() - zero).abs() <= STEP_DEG, "it was not unwound");
    p99
}

#[test]
fn in_real_time_at_a_port_a_turn_is_whole_and_has_its_angles() {
    turn_in_real_time(true);
}

#[test]
fn in_real_time_at_a_port_a_turn_without_the_chips_time_is_whole_and_has_its_angles() {
    turn_in_real_time(false);
}

/// A tenth of the paper's turn. Its angles are held to half a degree: how exact they are is measured
/// on virtual time, and here another program may keep the host from running.
fn turn_in_real_time(extras: bool) {
    let mut rig = PacedRig::new(&drifting());
    rig.options.extras = extras;
    let table = rig.open();
    table.home().unwrap();
    let truth = |t_us| rig.simulator.table().angle_at(t_us);
    let zero = truth(rig.options.clock.now_us());
    let turn = table.start_turn(turn_by(&table, 36.0)).unwrap();
    let track = turn.wait_end().unwrap();
    let (from, to) = track.constant_us();
    let turned = track.angle_at(to).unwrap() - track.angle_at(from).unwrap();
    assert!(turned.abs() >= 36.0, "{turned}");
    let errors = (from..to)
        .step_by(FRAME_US as usize)
        .map(|t| track.angle_at(t).unwrap() - (truth(t) - zero));
    let (_, p99, _) = spread(errors);
    assert!(p99 <= 0.5, "p99 {p99}");
    let stands = truth(rig.options.clock.now_us());
    assert!((stands - zero).abs() <= STEP_DEG, "it was not unwound");
}

#[test]
fn a_restart_in_the_middle_of_a_turn_fails_it_with_that_reason() {
    let rig = Rig::new("reset@30s");
    let table = rig.open();
    table.home().unwrap();
    let turn = table.start_turn(paper_turn(&table)).unwrap();
    let error = turn.wait_end().unwrap_err();
    assert!(
        matches!(error, TurntableError::Motion(MotionFault::Restarted(_))),
        "{error}"
    );
    assert!(matches!(
        table.start_turn(paper_turn(&table)),
        Err(TurntableError::NotHomed)
    ));
}

#[test]
fn a_controller_that_falls_silent_in_a_turn_is_noticed_within_seconds() {
    let rig = Rig::new("stall@30s");
    let on_us = rig.options.clock.now_us();
    let table = rig.open();
    table.home().unwrap();
    let turn = table.start_turn(paper_turn(&table)).unwrap();
    let error = turn.wait_end().unwrap_err();
    assert!(matches!(error, TurntableError::NotStopped), "{error}");
    // Two seconds of silence, and what a stop tries before it gives up.
    let noticed_us = rig.options.clock.now_us() - on_us - 30_000_000;
    assert!(noticed_us < 10_000_000, "{noticed_us} us: {error}");
}

#[test]
fn an_emergency_stop_in_a_turn_is_reported_as_one() {
    let rig = Rig::new("");
    let table = rig.open();
    table.home().unwrap();
    let mut turn = table.start_turn(paper_turn(&table)).unwrap();
    turn.wait_constant().unwrap();
    rig.simulated.press_emergency_stop(true);
    let error = turn.wait_end().unwrap_err();
    let is_emergency_stop = match &error {
        TurntableError::EmergencyStop => true,
        TurntableError::Motion(MotionFault::Alarm(alarm)) => alarm.is_emergency_stop(),
        _ => false,
    };
    assert!(is_emergency_stop, "{error}");
    check_stands(&rig);
}

#[test]
fn a_turn_that_is_dropped_stops_the_table() {
    let rig = Rig::new("");
    let table = rig.open();
    table.home().unwrap();
    let mut turn = table.start_turn(paper_turn(&table)).unwrap();
    turn.wait_constant().unwrap();
    drop(turn);
    check_stands(&rig);
    assert_eq!(table.stop().unwrap().state, ControllerState::Idle);
}

fn check_stands(rig: &Rig) {
    let stopped = rig.truth();
    rig.options.clock.sleep(Duration::from_secs(5));
    assert_eq!(rig.truth(), stopped, "it still moves");
}

#[test]
fn a_bad_wire_costs_repetitions_and_no_angle() {
    let rig = Rig::wired(
        SerialFaults {
            drop: 0.0005,
            flip: 0.0005,
            duplicate: 0.005,
            merge: 0.002,
            ..SerialFaults::default()
        },
        0,
    );
    let table = rig.open();
    table.home().unwrap();
    let zero = rig.truth();
    let track = table
        .start_turn(paper_turn(&table))
        .and_then(|turn| turn.wait_end())
        .unwrap();
    let (from, to) = track.constant_us();
    let errors = (from..to)
        .step_by(FRAME_US as usize)
        .map(|t| track.angle_at(t).unwrap() - (rig.simulated.angle_at(t) - zero));
    let (_, p99, _) = spread(errors);
    assert!(p99 <= 0.05, "p99 {p99}");
    let counts = table.counts();
    assert!(counts.repeats + counts.noise > 0, "no fault happened");
}
