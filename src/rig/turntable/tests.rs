//! The table from outside, against a peer that goes wrong on demand, on virtual time.

#![allow(clippy::unwrap_used, reason = "a test's own mistakes should be loud")]

use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::peer::{Peer, PeerPort, Trouble};
use super::*;
use crate::clock::Participant;

struct Rig {
    peer: Arc<Mutex<Peer>>,
    table: Table,
    _part: Participant,
}

fn open(peer: Peer) -> Rig {
    try_open(peer).unwrap()
}

fn try_open(peer: Peer) -> Result<Rig, TurntableError> {
    open_on(Clock::virtual_time(), peer)
}

fn open_on(clock: Clock, peer: Peer) -> Result<Rig, TurntableError> {
    let part = clock.take_part();
    let peer = Arc::new(Mutex::new(peer));
    let port = PeerPort {
        peer: Arc::clone(&peer),
        clock: clock.clone(),
    };
    let options = Options {
        clock,
        ..Options::default()
    };
    let table = Table::open(port, &options)?;
    Ok(Rig {
        peer,
        table,
        _part: part,
    })
}

impl Rig {
    fn set(&self, change: impl FnOnce(&mut Trouble, i64)) {
        let now_us = self.table.clock().now_us();
        change(&mut self.peer.lock().unwrap().trouble, now_us);
    }

    fn executed(&self) -> Vec<String> {
        self.peer.lock().unwrap().executed.clone()
    }

    fn plan(&self, turn_deg: f64) -> TurnPlan {
        let request = TurnRequest {
            turn_deg,
            ..TurnRequest::default()
        };
        let status = self.table.status().unwrap();
        TurnPlan::new(self.table.identity(), &status, &request).unwrap()
    }

    fn turn(&self, turn_deg: f64) -> Turn<'_> {
        self.table.start_turn(self.plan(turn_deg)).unwrap()
    }
}

#[test]
fn the_rigs_controller_is_known_by_what_it_says_and_spoken_to_in_checked_lines() {
    let rig = open(Peer::new(true));
    let identity = rig.table.identity();
    assert!(!identity.is_stock() && identity.extras.checked_lines);
    assert_eq!(identity.steps_per_degree, 88.889);
    let status = rig.table.status().unwrap();
    assert_eq!((status.state, status.homed), (State::Idle, false));
    assert_eq!(status.battery_v, Some(11.84));
}

#[test]
fn a_session_that_a_killed_owner_left_open_is_taken_over() {
    let mut peer = Peer::new(true);
    peer.leave_session_open();
    let rig = open(peer);
    assert!(rig.table.jog(1.0, None).is_ok());
}

#[test]
fn answers_to_an_echo_of_the_banner_are_passed_over() {
    for rig in [true, false] {
        let mut peer = Peer::new(rig);
        peer.trouble.echo = true;
        let rig = open(peer);
        assert!(rig.table.jog(1.0, None).is_ok());
    }
}

#[test]
fn nothing_behind_the_port_is_no_controller() {
    let mut peer = Peer::new(false);
    peer.trouble.silent_from_us = Some(0);
    peer.give();
    assert!(matches!(
        try_open(peer),
        Err(TurntableError::NoController { .. })
    ));
}

#[test]
fn a_table_found_moving_is_stopped_first() {
    let mut peer = Peer::new(false);
    let clock = Clock::virtual_time();
    peer.advance(clock.now_us());
    peer.take(b"G1X300F432\n");
    let rig = open_on(clock, peer).unwrap();
    assert_eq!(rig.table.status().unwrap().state, State::Idle);
    assert!(rig.peer.lock().unwrap().at < 100.0);
}

#[test]
fn a_jog_ends_at_its_place() {
    for rig in [open(Peer::new(true)), open(Peer::new(false))] {
        let status = rig.table.jog(12.5, Some(10.0)).unwrap();
        assert_eq!(status.state, State::Idle);
        assert!((status.angle_deg - 12.5).abs() < 0.02, "{status:?}");
        let status = rig.table.jog(-20.0, None).unwrap();
        assert!((status.angle_deg + 7.5).abs() < 0.02, "{status:?}");
    }
}

#[test]
fn a_jog_beyond_the_limit_or_at_no_speed_is_not_sent() {
    let rig = open(Peer::new(true));
    let before = rig.executed();
    let jog = |degrees, speed| rig.table.jog(degrees, speed).unwrap_err();
    assert!(matches!(
        jog(400.1, None),
        TurntableError::BeyondLimit { .. }
    ));
    assert!(matches!(jog(f64::NAN, None), TurntableError::Figure { .. }));
    assert!(matches!(
        jog(1.0, Some(36.1)),
        TurntableError::Figure { .. }
    ));
    assert!(matches!(jog(1.0, Some(0.0)), TurntableError::Figure { .. }));
    assert_eq!(rig.executed(), before);
}

#[test]
fn without_an_index_sensor_zero_is_where_the_table_stands() {
    let rig = open(Peer::new(false));
    rig.table.jog(30.0, None).unwrap();
    assert_eq!(rig.table.home().unwrap(), Homed::WhereItStands);
    let status = rig.table.status().unwrap();
    assert_eq!((status.angle_deg, status.homed), (0.0, true));
}

#[test]
fn homing_finds_the_index_or_says_that_there_is_none_although_it_was_accepted() {
    let rig = open(Peer::new(true).with_homing(true));
    assert_eq!(rig.table.home().unwrap(), Homed::Index);
    assert!(rig.table.status().unwrap().homed);
    let rig = open(Peer::new(false).with_homing(false));
    let error = rig.table.home().unwrap_err();
    assert!(error.to_string().contains("ALARM:9"), "{error}");
    let status = rig.table.status().unwrap();
    assert_eq!((status.homed, status.alarm), (false, Some(Alarm(Some(9)))));
    assert!(matches!(
        rig.table.jog(1.0, None),
        Err(TurntableError::NotReady { .. })
    ));
    assert_eq!(rig.table.unlock().unwrap().state, State::Idle);
}

#[test]
fn a_lost_answer_is_recovered_with_checked_lines_and_moves_once() {
    let rig = open(Peer::new(true));
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
    let rig = open(Peer::new(false));
    rig.set(|trouble, _| trouble.lose_answers = 1);
    let error = rig.table.jog(300.0, Some(1.0)).unwrap_err();
    assert!(matches!(error, TurntableError::Lost { .. }), "{error}");
    assert!(!rig.peer.lock().unwrap().is_moving());
    assert!(rig.table.jog(1.0, None).is_ok());
}

#[test]
fn a_line_damaged_unnoticed_is_no_success() {
    let rig = open(Peer::new(false));
    rig.set(|trouble, _| trouble.wrong_digits = 1);
    let error = rig.table.jog(25.0, None).unwrap_err();
    assert!(
        matches!(error, TurntableError::Motion(Fault::Astray { .. })),
        "{error}"
    );
}

#[test]
fn a_turn_tells_where_the_table_was_and_unwinds() {
    for stock in [false, true] {
        let rig = open(Peer::new(!stock));
        rig.peer.lock().unwrap().rate = 1.004;
        rig.table.home().unwrap();
        let mut turn = rig.turn(90.0);
        let constant = turn.wait_constant().unwrap();
        assert_eq!(turn.state().unwrap(), Phase::Constant);
        let track = turn.wait_end().unwrap();
        let (from_us, to_us) = track.constant_us();
        assert!((constant.from_us - from_us).abs() < 200_000);
        assert!((constant.to_us - to_us).abs() < 200_000);
        assert!((track.degrees_per_second() - 7.2 * 1.004).abs() < 0.01);

        let peer = rig.peer.lock().unwrap();
        let constant = peer
            .truth
            .iter()
            .filter(|(t, at)| *at > -2.0 && *at < 92.0 && (from_us..=to_us).contains(t));
        let mut off: Vec<f64> = constant
            .map(|(t, at)| (track.angle_at(*t).unwrap() - at).abs())
            .collect();
        off.sort_by(f64::total_cmp);
        assert!(off.len() > 11_000);
        assert!(off[off.len() * 99 / 100] < 0.05, "{:?}", off.last());
        assert!(peer.at.abs() < 0.02, "not unwound: {}", peer.at);
        assert_eq!(peer.lease, if stock { 0.0 } else { 3.0 });
    }
}

#[test]
fn a_turn_needs_a_position_and_the_place_it_was_planned_from() {
    let rig = open(Peer::new(true));
    let plan = rig.plan(90.0);
    let refused = |plan| rig.table.start_turn(plan).map(|_| ()).unwrap_err();
    assert!(matches!(refused(plan.clone()), TurntableError::NotHomed));
    rig.table.home().unwrap();
    rig.table.jog(1.0, None).unwrap();
    assert!(matches!(refused(plan), TurntableError::Moved { .. }));
}

/// Ends a turn by what `change` does to the peer; gives the fault and how long that took.
fn broken(stock: bool, change: impl FnOnce(&mut Trouble, i64)) -> (Rig, Fault, i64) {
    let rig = open(Peer::new(!stock));
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
        let cause = (!stock).then_some(ResetCause::Watchdog);
        assert_eq!(fault, Fault::Restarted(cause));
        assert!(!rig.table.status().unwrap().homed);

        let alarm = |trouble: &mut Trouble, now| trouble.alarm_at_us = Some((now, 10));
        let (rig, fault, _) = broken(stock, alarm);
        assert_eq!(fault, Fault::Alarm(Alarm(Some(10))));
        assert!(!rig.table.status().unwrap().homed);

        let (rig, fault, _) = broken(stock, |trouble, now| trouble.hold_at_us = Some(now));
        assert_eq!(fault, Fault::Held);
        assert!(rig.table.status().unwrap().homed);

        let (rig, fault, _) = broken(stock, |trouble, now| trouble.stall_from_us = Some(now));
        assert!(matches!(fault, Fault::Stalled { .. }), "{fault:?}");
        drop(rig);
    }
}

#[test]
fn a_controller_that_falls_silent_for_two_seconds_ends_the_turn() {
    let rig = open(Peer::new(true));
    rig.table.home().unwrap();
    let mut turn = rig.turn(90.0);
    turn.wait_constant().unwrap();
    let start_us = rig.table.clock().now_us();
    rig.set(|trouble, now| trouble.silent_from_us = Some(now));
    let link = rig.table.link();
    let found = link.wait(Duration::from_secs(10), |supervisor| {
        supervisor.fault().cloned()
    });
    let took_us = rig.table.clock().now_us() - start_us;
    assert!(matches!(found, Some(Fault::Silent { .. })), "{found:?}");
    assert!((1_900_000..4_000_000).contains(&took_us), "{took_us} us");
    // Nobody can tell whether it stands.
    assert!(matches!(turn.state(), Err(TurntableError::NotStopped)));
    drop(turn);
    assert!(rig.table.link().supervisor().zero_deg().is_none());
}

#[test]
fn a_stop_in_the_middle_keeps_the_position_and_the_table_goes_on() {
    for stock in [false, true] {
        let rig = open(Peer::new(!stock));
        rig.table.home().unwrap();
        let mut turn = rig.turn(90.0);
        turn.wait_constant().unwrap();
        let status = turn.abort().unwrap();
        assert!(status.homed && !status.state.may_move(), "{status:?}");
        assert!(status.angle_deg < 60.0);
        assert_eq!(rig.peer.lock().unwrap().resets, 1);
        let after = rig.table.jog(1.0, None).unwrap();
        assert!((after.angle_deg - status.angle_deg - 1.0).abs() < 0.03);
    }
}

#[test]
fn a_stop_from_elsewhere_ends_a_jog_with_that_reason() {
    let rig = open(Peer::new(true));
    let link = rig.table.link().clone();
    let clock = rig.table.clock().clone();
    let stopper = clock.spawn("stopper", move || {
        link.wait(Duration::from_secs(10), |s| {
            s.seen()?.state.may_move().then_some(())
        });
        link.stop()
    });
    let stopper = stopper.unwrap();
    let error = rig.table.jog(300.0, Some(5.0)).unwrap_err();
    assert!(
        matches!(error, TurntableError::Motion(Fault::Stopped)),
        "{error}"
    );
    assert!(!stopper.join().unwrap().unwrap().state.may_move());
}

#[test]
fn one_motion_at_a_time() {
    let rig = open(Peer::new(true));
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
    let rig = open(Peer::new(true));
    rig.table.home().unwrap();
    let mut turn = rig.turn(90.0);
    turn.wait_constant().unwrap();
    drop(turn);
    assert!(!rig.peer.lock().unwrap().is_moving());
    let Rig { peer, table, .. } = rig;
    drop(table);
    let mut peer = peer.lock().unwrap();
    let before = peer.executed.len();
    peer.take(b"G4P1\n");
    assert_eq!(
        peer.executed.len(),
        before + 1,
        "a plain line is taken again"
    );
}

#[test]
fn every_wait_ends() {
    let rig = open(Peer::new(false));
    rig.set(|trouble, now| trouble.silent_from_us = Some(now));
    let clock = rig.table.clock().clone();
    let start_us = clock.now_us();
    assert!(matches!(
        rig.table.status(),
        Err(TurntableError::Silent { .. })
    ));
    assert!(matches!(rig.table.stop(), Err(TurntableError::NotStopped)));
    drop(rig);
    assert!(clock.now_us() - start_us < 30_000_000);
}
