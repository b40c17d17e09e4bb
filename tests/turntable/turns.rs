//! Whole turns against the simulated table, whose true angle is known at any moment.

use relit_rig::simulator::SimulatorOptions;
use relit_rig::turntable::{Fault, Homed, State, TurntableError};

use crate::rig::{Rig, STEP_DEG, paper_turn, spread};

const SPEED: f64 = 10.0;
const FRAME_US: i64 = 33_333;

#[test]
fn every_frame_of_a_turn_gets_its_angle() {
    let rig = drifting(SPEED);
    let p99 = turn_and_compare(&rig);
    assert!(p99 <= 0.05, "p99 {p99}");
}

#[test]
fn without_the_chips_time_every_frame_of_a_turn_gets_its_angle_too() {
    let rig = drifting(SPEED).plain();
    let p99 = turn_and_compare(&rig);
    assert!(p99 <= 0.05, "p99 {p99}");
}

#[test]
#[ignore = "takes more than two minutes: the same in real time, run with --nocapture"]
fn in_real_time_every_frame_of_a_turn_gets_its_angle() {
    for rig in [drifting(1.0), drifting(1.0).plain()] {
        let p99 = turn_and_compare(&rig);
        assert!(p99 <= 0.05, "p99 {p99}");
    }
}

/// A table whose chip has a ceramic resonator: 1500 parts in a million off.
fn drifting(speed: f64) -> Rig {
    let options = SimulatorOptions {
        drift_ppm: 1500.0,
        ..SimulatorOptions::default()
    };
    Rig::with(speed, "", options)
}

/// Turns once, and gives the 99th percentile of the angle's error over the frames of the turn.
fn turn_and_compare(rig: &Rig) -> f64 {
    let table = rig.open();
    assert_eq!(table.home().unwrap(), Homed::WhereItStands);
    let zero = rig.truth();
    let turn = table.start_turn(paper_turn(&table)).unwrap();
    let track = turn.wait_end().unwrap();
    let (from, to) = track.constant_us();
    let turned = track.angle_at(to).unwrap() - track.angle_at(from).unwrap();
    assert!(turned.abs() >= 360.0, "{turned}");
    let errors: Vec<f64> = (0..1500)
        .map(|frame| from + frame * FRAME_US)
        .filter_map(|t| Some(track.angle_at(t)? - (rig.simulator.angle_at(t) - zero)))
        .collect();
    assert_eq!(errors.len(), 1500);
    let (median, p99, largest) = spread(errors);
    println!(
        "angle error, degrees: median {median:.4}, p99 {p99:.4}, largest {largest:.4}; {} polls, \
         half a round trip {:.0} us",
        track.polls(),
        track.half_round_trip_us()
    );
    assert!((rig.truth() - zero).abs() <= STEP_DEG, "it was not unwound");
    p99
}

#[test]
fn a_restart_in_the_middle_of_a_turn_fails_it_with_that_reason() {
    let rig = Rig::new(SPEED, "reset@30s");
    let table = rig.open();
    table.home().unwrap();
    let turn = table.start_turn(paper_turn(&table)).unwrap();
    let error = turn.wait_end().unwrap_err();
    assert!(
        matches!(error, TurntableError::Motion(Fault::Restarted(_))),
        "{error}"
    );
    assert!(matches!(
        table.start_turn(paper_turn(&table)),
        Err(TurntableError::NotHomed)
    ));
}

#[test]
fn a_controller_that_falls_silent_in_a_turn_is_noticed_within_seconds() {
    let rig = Rig::new(SPEED, "stall@30s");
    let table = rig.open();
    table.home().unwrap();
    let turn = table.start_turn(paper_turn(&table)).unwrap();
    let began = rig.options.clock.now_us();
    let error = turn.wait_end().unwrap_err();
    let noticed = rig.options.clock.now_us() - began;
    assert!(
        matches!(
            error,
            TurntableError::Motion(_) | TurntableError::NotStopped
        ),
        "{error}"
    );
    assert!(noticed < 60_000_000, "{noticed} us: {error}");
}

#[test]
fn an_emergency_stop_in_a_turn_is_told_as_one() {
    let rig = Rig::new(SPEED, "");
    let table = rig.open();
    table.home().unwrap();
    let mut turn = table.start_turn(paper_turn(&table)).unwrap();
    turn.wait_constant().unwrap();
    rig.simulator.press_emergency_stop(true);
    let error = turn.wait_end().unwrap_err();
    assert!(error.to_string().contains("mergency"), "{error}");
    rig.options.clock.sleep(std::time::Duration::from_secs(1));
    let stopped = rig.truth();
    rig.options.clock.sleep(std::time::Duration::from_secs(5));
    assert_eq!(rig.truth(), stopped, "it still moves");
}

#[test]
fn a_turn_that_is_dropped_stops_the_table() {
    let rig = Rig::new(SPEED, "");
    let table = rig.open();
    table.home().unwrap();
    let mut turn = table.start_turn(paper_turn(&table)).unwrap();
    turn.wait_constant().unwrap();
    drop(turn);
    let status = table.stop().unwrap();
    assert_eq!(status.state, State::Idle);
    let stopped = rig.truth();
    rig.options.clock.sleep(std::time::Duration::from_secs(5));
    assert_eq!(rig.truth(), stopped, "it still moves");
}

#[test]
fn a_bad_wire_costs_repetitions_and_no_angle() {
    let rig = Rig::new(SPEED, "drop=0.0005,flip=0.0005,duplicate=0.005,merge=0.002");
    let table = rig.open();
    table.home().unwrap();
    let zero = rig.truth();
    match table
        .start_turn(paper_turn(&table))
        .and_then(|turn| turn.wait_end())
    {
        Ok(track) => {
            let (from, to) = track.constant_us();
            let errors = (from..to)
                .step_by(FRAME_US as usize)
                .map(|t| track.angle_at(t).unwrap() - (rig.simulator.angle_at(t) - zero));
            let (_, p99, _) = spread(errors);
            assert!(p99 <= 0.05, "p99 {p99}");
        }
        // A flipped bit can make a hold or a reset of any byte: then the turn says so.
        Err(error) => assert!(matches!(error, TurntableError::Motion(_)), "{error}"),
    }
}
