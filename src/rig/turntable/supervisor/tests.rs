#![allow(clippy::unwrap_used, reason = "a test's own mistakes should be loud")]

use std::time::Duration;

use super::*;

const TRAITS: ControllerTraits = ControllerTraits {
    degrees_per_unit: 1.0,
    poll: Duration::from_millis(67),
    stamps: true,
    reports_homing: true,
    step_deg: 1.0 / 88.889,
};

/// A supervisor with its time, driven by hand.
struct Desk {
    supervisor: Supervisor,
    now_us: i64,
}

impl Desk {
    fn new() -> Desk {
        let supervisor = Supervisor::new(TRAITS);
        let mut desk = Desk {
            supervisor,
            now_us: 0,
        };
        desk.supervisor.set_zero_deg(0.0);
        desk
    }

    /// Lets time pass; gives what is sent, without the questions.
    fn pass(&mut self, milliseconds: i64) -> Vec<u8> {
        let mut sent = Vec::new();
        for _ in 0..milliseconds / 10 {
            self.now_us += 10_000;
            self.supervisor.on_time(self.now_us);
            sent.extend(self.supervisor.take_output(self.now_us));
        }
        sent.retain(|byte| *byte != b'?');
        sent
    }

    fn hear(&mut self, line: &str) {
        let bytes = format!("{line}\r\n").into_bytes();
        self.supervisor.on_bytes(self.now_us, &bytes);
    }

    /// Reports this state for a while; gives what is sent.
    fn report(&mut self, state: &str, at: f64, times: usize) -> Vec<u8> {
        let mut sent = Vec::new();
        for _ in 0..times {
            sent.extend(self.pass(80));
            self.hear(&format!("<{state}|MPos:{at:.3},0.000,0.000|FS:432,0>"));
        }
        sent
    }

    fn moving(&mut self, target_deg: f64) {
        let goal = MotionGoal::To {
            target_deg,
            within_us: 60_000_000,
        };
        self.supervisor.begin_motion(self.now_us, goal);
        self.supervisor.motion_accepted(self.now_us);
    }
}

#[test]
fn a_stop_holds_waits_for_rest_and_resets_only_then() {
    let mut desk = Desk::new();
    desk.moving(100.0);
    desk.report("Run", 10.0, 1);
    desk.supervisor.request_stop(desk.now_us);
    assert_eq!(desk.report("Hold:1", 10.5, 1), b"!");
    let sent = desk.report("Hold:1", 11.0, 2);
    assert!(!sent.contains(&0x18));
    desk.report("Hold:0", 11.2, 2);
    assert_eq!(desk.pass(20), [0x18]);
    desk.hear("Grbl 1.1h ['$' for help]");
    assert!(desk.supervisor.is_stopping());
    desk.report("Idle", 11.2, 2);
    assert_eq!(desk.supervisor.stopped(), Some(StopOutcome::Standing));
    assert_eq!(desk.supervisor.zero_deg(), Some(0.0));
    assert_eq!(desk.supervisor.fault(), Some(&MotionFault::Stopped));
}

#[test]
fn a_hold_that_is_lost_is_sent_again() {
    let mut desk = Desk::new();
    desk.supervisor.request_stop(0);
    let sent = desk.report("Run", 10.0, 8);
    assert!(sent.iter().filter(|byte| **byte == b'!').count() >= 2);
    assert!(!sent.contains(&0x18));
}

#[test]
fn a_table_that_does_not_slow_down_or_says_nothing_is_reset_in_motion_and_not_homed_any_more() {
    let mut desk = Desk::new();
    desk.supervisor.request_stop(0);
    assert!(desk.report("Run", 10.0, 70).contains(&0x18));
    desk.hear("ALARM:3");
    desk.hear("Grbl 1.1h ['$' for help]");
    desk.report("Alarm", 10.0, 2);
    assert_eq!(desk.supervisor.stopped(), Some(StopOutcome::Standing));
    assert_eq!(desk.supervisor.zero_deg(), None);

    let mut desk = Desk::new();
    desk.supervisor.request_stop(0);
    assert!(desk.pass(1000).contains(&0x18));
    desk.pass(6000);
    assert_eq!(desk.supervisor.stopped(), Some(StopOutcome::Unknown));
    assert_eq!(desk.supervisor.zero_deg(), None);
}

#[test]
fn a_search_for_the_index_is_ended_by_a_reset() {
    let mut desk = Desk::new();
    desk.supervisor.request_stop(0);
    let sent = desk.report("Home", 10.0, 2);
    assert!(sent.ends_with(&[0x18]) || desk.pass(20) == [0x18]);
}

#[test]
fn a_reset_that_counts_from_elsewhere_afterwards_has_lost_the_position() {
    let mut desk = Desk::new();
    desk.supervisor.request_stop(0);
    desk.report("Hold:0", 11.2, 2);
    desk.pass(20);
    desk.hear("Grbl 1.1h ['$' for help]");
    desk.report("Idle", 0.0, 2);
    assert_eq!(desk.supervisor.stopped(), Some(StopOutcome::Displaced));
    assert_eq!(desk.supervisor.zero_deg(), None);
}

#[test]
fn a_restart_for_another_reason_during_a_stop_loses_the_position() {
    let mut desk = Desk::new();
    desk.supervisor.request_stop(0);
    desk.report("Hold:0", 11.2, 2);
    desk.pass(20);
    desk.hear("Grbl 1.1h ['$' for help] [reset: brown-out]");
    assert_eq!(desk.supervisor.zero_deg(), None);
    desk.report("Idle", 11.2, 2);
    assert!(!desk.supervisor.is_stopping());
}

#[test]
fn nothing_is_sent_while_the_table_is_being_stopped() {
    let mut desk = Desk::new();
    desk.supervisor.request_stop(0);
    let sent = desk.supervisor.send(0, "$X", ReplyTimeout::AtOnce);
    assert_eq!(sent, Err(SendError::Busy));
}

#[test]
fn a_motion_is_over_when_the_table_rests_at_its_target_by_a_report_asked_for_afterwards() {
    let mut desk = Desk::new();
    desk.moving(10.0);
    desk.hear("<Idle|MPos:10.000,0.000,0.000|FS:0,0>");
    assert!(!desk.supervisor.motion().unwrap().is_at_target());
    desk.report("Run", 5.0, 1);
    desk.report("Idle", 9.991, 1);
    assert!(desk.supervisor.motion().unwrap().is_at_target());
    assert_eq!(desk.supervisor.fault(), None);
}

#[test]
fn a_table_that_rests_elsewhere_is_astray_after_a_while() {
    let mut desk = Desk::new();
    desk.moving(10.0);
    desk.report("Idle", 0.0, 5);
    assert_eq!(desk.supervisor.fault(), None);
    desk.report("Idle", 0.0, 5);
    assert!(matches!(
        desk.supervisor.fault(),
        Some(MotionFault::Astray { .. })
    ));
    assert!(desk.supervisor.is_stopping());
}

#[test]
fn a_motion_that_takes_too_long_is_late() {
    let mut desk = Desk::new();
    desk.moving(1000.0);
    for tenth in 0..750 {
        desk.report("Run", f64::from(tenth) / 10.0, 1);
    }
    assert_eq!(desk.supervisor.fault(), None);
    desk.report("Run", 80.0, 1);
    desk.pass(500);
    assert_eq!(desk.supervisor.fault(), Some(&MotionFault::Late));
}

#[test]
fn work_positions_count_once_their_zero_is_known_and_inches_are_converted() {
    let mut desk = Desk::new();
    desk.hear("<Idle|WPos:1.000,0.000,0.000|FS:0,0>");
    assert!(desk.supervisor.last_report().is_none());
    desk.hear("<Idle|WPos:1.000,0.000,0.000|FS:0,0|WCO:2.000,0.000,0.000>");
    assert_eq!(desk.supervisor.last_report().unwrap().machine_deg, 3.0);
    desk.supervisor.set_traits(ControllerTraits {
        degrees_per_unit: 25.4,
        ..TRAITS
    });
    desk.hear("<Idle|MPos:1.000,0.000,0.000|FS:0,0>");
    assert_eq!(desk.supervisor.last_report().unwrap().machine_deg, 25.4);
}

#[test]
fn without_checksums_a_report_counts_when_the_one_before_says_the_same() {
    let mut desk = Desk::new();
    desk.report("Idle", 3.0, 2);
    assert!(desk.supervisor.is_confirmed());
    desk.report("Idle", 673.0, 1);
    assert!(!desk.supervisor.is_confirmed());
    desk.report("Idle", 3.0, 2);
    assert!(desk.supervisor.is_confirmed());
    desk.report("Run", 3.0, 1);
    assert!(!desk.supervisor.is_confirmed());
    desk.report("Run", 4.0, 1);
    assert!(desk.supervisor.is_confirmed());
}

#[test]
fn a_report_that_comes_twice_and_late_is_no_stall() {
    let mut desk = Desk::new();
    desk.moving(10.0);
    desk.report("Run", 5.0, 1);
    desk.now_us += 850_000;
    desk.hear("<Run|MPos:5.000,0.000,0.000|FS:432,0>");
    assert_eq!(desk.supervisor.fault(), None);
    desk.report("Run", 5.0, 12);
    assert!(matches!(
        desk.supervisor.fault(),
        Some(MotionFault::Stalled { .. })
    ));
}

#[test]
fn a_banner_at_rest_loses_the_position_without_stopping_anything() {
    let mut desk = Desk::new();
    desk.hear("Grbl 1.1h ['$' for help]");
    assert_eq!(desk.supervisor.zero_deg(), None);
    assert!(!desk.supervisor.is_stopping());
    assert_eq!(desk.supervisor.restarts(), 1);
}
