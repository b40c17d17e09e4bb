//! The table as a whole, against a fake controller with faults on demand, on virtual time.

#![allow(clippy::unwrap_used, reason = "a test's own mistakes should be loud")]

pub(super) mod fake_grbl;
mod owned_port;
mod relatives;

use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::*;
use fake_grbl::{FakeGrbl, FakePort, InjectedFaults};
use relit_data::clock::Participant;

struct Rig {
    fake_grbl: Arc<Mutex<FakeGrbl>>,
    table: Table,
    _participant: Participant,
}

fn open(fake_grbl: FakeGrbl) -> Rig {
    try_open(fake_grbl).unwrap()
}

fn try_open(fake_grbl: FakeGrbl) -> Result<Rig, TurntableError> {
    open_on(Clock::virtual_time(), fake_grbl)
}

fn open_on(clock: Clock, fake_grbl: FakeGrbl) -> Result<Rig, TurntableError> {
    let participant = clock.participate();
    let fake_grbl = Arc::new(Mutex::new(fake_grbl));
    let port = FakePort {
        fake_grbl: Arc::clone(&fake_grbl),
        clock: clock.clone(),
    };
    let options = TableOptions {
        clock,
        ..TableOptions::default()
    };
    let table = Table::open(port, &options)?;
    Ok(Rig {
        fake_grbl,
        table,
        _participant: participant,
    })
}

impl Rig {
    fn set(&self, change: impl FnOnce(&mut InjectedFaults, i64)) {
        let now_us = self.table.clock().now_us();
        change(&mut self.fake_grbl.lock().unwrap().trouble, now_us);
    }

    fn executed(&self) -> Vec<String> {
        self.fake_grbl.lock().unwrap().executed.clone()
    }

    fn plan(&self, turn_deg: f64) -> TurnPlan {
        let status = self.table.status().unwrap();
        TurnPlan::new(self.table.identity(), &status, 7.2, turn_deg).unwrap()
    }

    fn turn(&self, turn_deg: f64) -> Turn<'_> {
        self.table.start_turn(self.plan(turn_deg)).unwrap()
    }
}

#[test]
fn the_rigs_controller_is_recognised_by_its_options_and_gets_checked_lines() {
    let rig = open(FakeGrbl::new(true));
    let identity = rig.table.identity();
    assert!(identity.extras);
    assert_eq!(identity.steps_per_degree, 88.889);
    let status = rig.table.status().unwrap();
    assert_eq!((status.state, status.homed), (ControllerState::Idle, false));
    assert_eq!(status.battery_v, Some(11.84));
}

#[test]
fn a_session_that_a_killed_owner_left_open_is_taken_over() {
    let mut fake_grbl = FakeGrbl::new(true);
    fake_grbl.leave_session_open();
    let rig = open(fake_grbl);
    assert!(rig.table.jog(1.0, None).is_ok());
}

#[test]
fn answers_to_an_echo_of_the_banner_are_ignored() {
    for rig in [true, false] {
        let mut fake_grbl = FakeGrbl::new(rig);
        fake_grbl.trouble.echo = true;
        let rig = open(fake_grbl);
        assert!(rig.table.jog(1.0, None).is_ok());
    }
}

#[test]
fn a_silent_port_has_no_controller() {
    let mut fake_grbl = FakeGrbl::new(false);
    fake_grbl.trouble.silent_from_us = Some(0);
    fake_grbl.give();
    assert!(matches!(
        try_open(fake_grbl),
        Err(TurntableError::Failed(_))
    ));
}

#[test]
fn a_table_found_moving_is_stopped_first() {
    let mut fake_grbl = FakeGrbl::new(false);
    let clock = Clock::virtual_time();
    fake_grbl.advance(clock.now_us());
    fake_grbl.take(b"G1X300F432\n");
    let rig = open_on(clock, fake_grbl).unwrap();
    assert_eq!(rig.table.status().unwrap().state, ControllerState::Idle);
    assert!(rig.fake_grbl.lock().unwrap().at < 100.0);
}

#[test]
fn a_jog_ends_at_its_place() {
    for rig in [open(FakeGrbl::new(true)), open(FakeGrbl::new(false))] {
        let status = rig.table.jog(12.5, Some(10.0)).unwrap();
        assert_eq!(status.state, ControllerState::Idle);
        assert!((status.angle_deg - 12.5).abs() < 0.02, "{status:?}");
        let status = rig.table.jog(-20.0, None).unwrap();
        assert!((status.angle_deg + 7.5).abs() < 0.02, "{status:?}");
    }
}

#[test]
fn a_jog_beyond_the_limit_or_at_no_speed_is_not_sent() {
    let rig = open(FakeGrbl::new(true));
    let before = rig.executed();
    let jog = |degrees, speed| rig.table.jog(degrees, speed).unwrap_err();
    assert!(matches!(jog(400.1, None), TurntableError::Failed(_)));
    assert!(matches!(
        jog(f64::NAN, None),
        TurntableError::OutOfRange { .. }
    ));
    assert!(matches!(
        jog(1.0, Some(36.1)),
        TurntableError::OutOfRange { .. }
    ));
    assert!(matches!(
        jog(1.0, Some(0.0)),
        TurntableError::OutOfRange { .. }
    ));
    assert_eq!(rig.executed(), before);
}

#[test]
fn without_an_index_sensor_zero_is_where_the_table_stands() {
    let rig = open(FakeGrbl::new(false));
    rig.table.jog(30.0, None).unwrap();
    assert_eq!(rig.table.home().unwrap(), HomingResult::WhereItStands);
    let status = rig.table.status().unwrap();
    assert_eq!((status.angle_deg, status.homed), (0.0, true));
}

#[test]
fn homing_finds_the_index_or_says_that_there_is_none_although_it_was_accepted() {
    let rig = open(FakeGrbl::new(true).with_homing(true));
    assert_eq!(rig.table.home().unwrap(), HomingResult::Index);
    assert!(rig.table.status().unwrap().homed);
    let rig = open(FakeGrbl::new(false).with_homing(false));
    let error = rig.table.home().unwrap_err();
    let TurntableError::Motion(MotionFault::Alarm(alarm)) = error else {
        panic!("{error}");
    };
    assert_eq!(alarm.code, Some(9));
    let status = rig.table.status().unwrap();
    let code = status.alarm.and_then(|alarm| alarm.code);
    assert_eq!((status.homed, code), (false, Some(9)));
    assert!(matches!(
        rig.table.jog(1.0, None),
        Err(TurntableError::NotReady { .. })
    ));
    assert_eq!(rig.table.unlock().unwrap().state, ControllerState::Idle);
}

#[test]
fn a_lost_answer_is_recovered_with_checked_lines_and_moves_once() {
    let rig = open(FakeGrbl::new(true));
    rig.set(|trouble, _| trouble.lose_answers = 3);
    rig.table.jog(5.0, None).unwrap();
    let jogs = rig
        .executed()
        .iter()
        .filter(|line| line.starts_with("$J"))
        .count();
    assert_eq!((jogs, rig.table.counts().repeats), (1, 3));
}

#[test]
fn a_lost_answer_of_a_stock_board_stops_the_table_with_the_reason() {
    let rig = open(FakeGrbl::new(false));
    rig.set(|trouble, _| trouble.lose_answers = 1);
    let error = rig.table.jog(300.0, Some(1.0)).unwrap_err();
    assert!(matches!(error, TurntableError::Lost { .. }), "{error}");
    assert!(!rig.fake_grbl.lock().unwrap().is_moving());
    assert!(rig.table.jog(1.0, None).is_ok());
}

#[test]
fn an_undetected_damage_of_a_line_is_no_success() {
    let rig = open(FakeGrbl::new(false));
    rig.set(|trouble, _| trouble.wrong_digits = 1);
    let error = rig.table.jog(25.0, None).unwrap_err();
    assert!(
        matches!(error, TurntableError::Motion(MotionFault::Astray { .. })),
        "{error}"
    );
}

#[test]
fn a_turn_has_the_angles_of_the_table_and_unwinds() {
    for stock in [false, true] {
        let rig = open(FakeGrbl::new(!stock));
        rig.fake_grbl.lock().unwrap().rate = 1.004;
        rig.table.home().unwrap();
        let mut turn = rig.turn(90.0);
        let constant = turn.wait_constant().unwrap();
        turn.check().unwrap();
        let track = turn.wait_end().unwrap();
        let (from_us, to_us) = track.constant_us();
        assert!((constant - from_us).abs() < 200_000);
        assert!((track.degrees_per_second() - 7.2 * 1.004).abs() < 0.01);

        let fake_grbl = rig.fake_grbl.lock().unwrap();
        let constant = fake_grbl
            .truth
            .iter()
            .filter(|(t, at)| *at > -2.0 && *at < 92.0 && (from_us..=to_us).contains(t));
        let mut off: Vec<f64> = constant
            .map(|(t, at)| (track.angle_at(*t).unwrap() - at).abs())
            .collect();
        off.sort_by(f64::total_cmp);
        assert!(off.len() > 11_000);
        assert!(off[off.len() * 99 / 100] < 0.05, "{:?}", off.last());
        assert!(fake_grbl.at.abs() < 0.02, "not unwound: {}", fake_grbl.at);
        assert_eq!(fake_grbl.lease, if stock { 0.0 } else { 3.0 });
    }
}

#[test]
fn a_turn_needs_a_position_and_the_place_it_was_planned_from() {
    let rig = open(FakeGrbl::new(true));
    let plan = rig.plan(90.0);
    let refused = |plan| rig.table.start_turn(plan).map(|_| ()).unwrap_err();
    assert!(matches!(refused(plan.clone()), TurntableError::NotHomed));
    rig.table.home().unwrap();
    rig.table.jog(1.0, None).unwrap();
    assert!(matches!(refused(plan), TurntableError::Failed(_)));
}

/// Breaks a turn by a change of the controller's faults; returns the fault that ended it, and the time
/// until then.
fn broken(stock: bool, change: impl FnOnce(&mut InjectedFaults, i64)) -> (Rig, MotionFault, i64) {
    let rig = open(FakeGrbl::new(!stock));
    rig.table.home().unwrap();
    let mut turn = rig.turn(90.0);
    turn.wait_constant().unwrap();
    let start_us = rig.table.clock().now_us();
    rig.set(change);
    let error = turn.wait_end().unwrap_err();
    let took_us = rig.table.clock().now_us() - start_us;
    let TurntableError::Motion(fault) = error else {
        panic!("{error}");
    };
    (rig, fault, took_us)
}

#[test]
fn whatever_breaks_a_turn_ends_it_with_its_reason_and_stops_the_table() {
    for stock in [false, true] {
        let (rig, fault, _) = broken(stock, |trouble, now| trouble.reset_at_us = Some(now));
        let cause = (!stock).then(|| "watchdog".to_owned());
        assert_eq!(fault, MotionFault::Restarted(cause));
        assert!(!rig.table.status().unwrap().homed);

        let alarm = |trouble: &mut InjectedFaults, now| trouble.alarm_at_us = Some((now, 10));
        let (rig, fault, _) = broken(stock, alarm);
        assert!(
            matches!(fault, MotionFault::Alarm(Alarm { code: Some(10), .. })),
            "{fault:?}"
        );
        assert!(!rig.table.status().unwrap().homed);

        let (rig, fault, _) = broken(stock, |trouble, now| trouble.hold_at_us = Some(now));
        assert_eq!(fault, MotionFault::Held);
        assert!(rig.table.status().unwrap().homed);

        let (rig, fault, _) = broken(stock, |trouble, now| trouble.stall_from_us = Some(now));
        assert!(matches!(fault, MotionFault::Stalled { .. }), "{fault:?}");
        drop(rig);
    }
}

#[test]
fn a_controller_that_falls_silent_for_two_seconds_ends_the_turn() {
    let rig = open(FakeGrbl::new(true));
    rig.table.home().unwrap();
    let mut turn = rig.turn(90.0);
    turn.wait_constant().unwrap();
    let start_us = rig.table.clock().now_us();
    rig.set(|trouble, now| trouble.silent_from_us = Some(now));
    let connection = rig.table.connection();
    let found = connection.wait(Duration::from_secs(10), |supervisor| {
        supervisor.fault().cloned()
    });
    let took_us = rig.table.clock().now_us() - start_us;
    assert!(
        matches!(found, Some(MotionFault::Silent { .. })),
        "{found:?}"
    );
    assert!((1_900_000..4_000_000).contains(&took_us), "{took_us} us");
    // Whether it stands is unknown.
    assert!(matches!(turn.check(), Err(TurntableError::NotStopped)));
    drop(turn);
    assert!(rig.table.connection().supervisor().zero_deg().is_none());
}

#[test]
fn a_stop_in_the_middle_keeps_the_position_and_the_table_goes_on() {
    for stock in [false, true] {
        let rig = open(FakeGrbl::new(!stock));
        rig.table.home().unwrap();
        let mut turn = rig.turn(90.0);
        turn.wait_constant().unwrap();
        let status = turn.abort().unwrap();
        assert!(status.homed && !status.state.may_move(), "{status:?}");
        assert!(status.angle_deg < 60.0);
        assert_eq!(rig.fake_grbl.lock().unwrap().resets, 1);
        let after = rig.table.jog(1.0, None).unwrap();
        assert!((after.angle_deg - status.angle_deg - 1.0).abs() < 0.03);
    }
}

#[test]
fn a_stop_from_another_thread_ends_a_jog_with_that_reason() {
    let rig = open(FakeGrbl::new(true));
    let connection = rig.table.connection().clone();
    let clock = rig.table.clock().clone();
    let stopper = clock.spawn("stopper", move || {
        connection.wait(Duration::from_secs(10), |s| {
            s.last_report()?.state.may_move().then_some(())
        });
        connection.stop()
    });
    let stopper = stopper.unwrap();
    let error = rig.table.jog(300.0, Some(5.0)).unwrap_err();
    assert!(
        matches!(error, TurntableError::Motion(MotionFault::Stopped)),
        "{error}"
    );
    assert!(!stopper.join().unwrap().unwrap().state.may_move());
}

#[test]
fn one_motion_at_a_time() {
    let rig = open(FakeGrbl::new(true));
    rig.table.home().unwrap();
    let turn = rig.turn(90.0);
    assert!(matches!(
        rig.table.jog(1.0, None),
        Err(TurntableError::Busy)
    ));
    drop(turn);
    assert!(rig.table.jog(1.0, None).is_ok());
}

#[test]
fn a_dropped_turn_and_a_dropped_table_stand_still_and_leave_no_session() {
    let rig = open(FakeGrbl::new(true));
    rig.table.home().unwrap();
    let mut turn = rig.turn(90.0);
    turn.wait_constant().unwrap();
    drop(turn);
    assert!(!rig.fake_grbl.lock().unwrap().is_moving());
    let Rig {
        fake_grbl, table, ..
    } = rig;
    drop(table);
    let mut fake_grbl = fake_grbl.lock().unwrap();
    let before = fake_grbl.executed.len();
    fake_grbl.take(b"G4P1\n");
    assert_eq!(
        fake_grbl.executed.len(),
        before + 1,
        "a plain line is taken again"
    );
}

#[test]
fn every_wait_ends() {
    let rig = open(FakeGrbl::new(false));
    rig.set(|trouble, now| trouble.silent_from_us = Some(now));
    let clock = rig.table.clock().clone();
    let start_us = clock.now_us();
    assert!(matches!(rig.table.status(), Err(TurntableError::Failed(_))));
    assert!(matches!(rig.table.stop(), Err(TurntableError::NotStopped)));
    drop(rig);
    assert!(clock.now_us() - start_us < 30_000_000);
}
