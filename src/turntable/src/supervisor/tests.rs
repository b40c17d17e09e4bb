#![allow(clippy::unwrap_used, reason = "a test's own mistakes should be loud")]

use std::time::Duration;

use super::*;
use crate::family::Family;

const TRAITS: ControllerFeatures = ControllerFeatures {
    family: Family::GrblHal,
    poll: Duration::from_millis(67),
    stamps: true,
    reports_homing: true,
    step_deg: 1.0 / 88.889,
};

/// A supervisor with its time, driven by hand.
struct Bench {
    supervisor: Supervisor,
    now_us: i64,
}

impl Bench {
    fn new() -> Bench {
        let supervisor = Supervisor::new(TRAITS);
        let mut bench = Bench {
            supervisor,
            now_us: 0,
        };
        bench.supervisor.set_zero_deg(0.0);
        bench
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
    let mut bench = Bench::new();
    bench.moving(100.0);
    bench.report("Run", 10.0, 1);
    bench.supervisor.request_stop(bench.now_us);
    assert_eq!(bench.report("Hold:1", 10.5, 1), b"!");
    let sent = bench.report("Hold:1", 11.0, 2);
    assert!(!sent.contains(&0x18));
    bench.report("Hold:0", 11.2, 2);
    assert_eq!(bench.pass(20), [0x18]);
    bench.hear("Grbl 1.1h ['$' for help]");
    assert!(bench.supervisor.is_stopping());
    bench.report("Idle", 11.2, 2);
    assert_eq!(bench.supervisor.stopped(), Some(StopOutcome::Stopped));
    assert_eq!(bench.supervisor.zero_deg(), Some(0.0));
    assert_eq!(bench.supervisor.fault(), Some(&MotionFault::Stopped));
}

#[test]
fn a_hold_that_is_lost_is_sent_again() {
    let mut bench = Bench::new();
    bench.supervisor.request_stop(0);
    let sent = bench.report("Run", 10.0, 8);
    assert!(sent.iter().filter(|byte| **byte == b'!').count() >= 2);
    assert!(!sent.contains(&0x18));
}

#[test]
fn a_table_that_does_not_slow_down_or_says_nothing_is_reset_in_motion_and_not_homed_any_more() {
    let mut bench = Bench::new();
    bench.supervisor.request_stop(0);
    assert!(bench.report("Run", 10.0, 70).contains(&0x18));
    bench.hear("ALARM:3");
    bench.hear("Grbl 1.1h ['$' for help]");
    bench.report("Alarm", 10.0, 2);
    assert_eq!(bench.supervisor.stopped(), Some(StopOutcome::Stopped));
    assert_eq!(bench.supervisor.zero_deg(), None);

    let mut bench = Bench::new();
    bench.supervisor.request_stop(0);
    assert!(bench.pass(1000).contains(&0x18));
    bench.pass(6000);
    assert_eq!(bench.supervisor.stopped(), Some(StopOutcome::Unknown));
    assert_eq!(bench.supervisor.zero_deg(), None);
}

#[test]
fn a_search_for_the_index_is_ended_by_a_reset() {
    let mut bench = Bench::new();
    bench.supervisor.request_stop(0);
    let sent = bench.report("Home", 10.0, 2);
    assert!(sent.ends_with(&[0x18]) || bench.pass(20) == [0x18]);
}

#[test]
fn a_reset_that_counts_from_elsewhere_afterwards_has_lost_the_position() {
    let mut bench = Bench::new();
    bench.supervisor.request_stop(0);
    bench.report("Hold:0", 11.2, 2);
    bench.pass(20);
    bench.hear("Grbl 1.1h ['$' for help]");
    bench.report("Idle", 0.0, 2);
    assert_eq!(bench.supervisor.stopped(), Some(StopOutcome::Displaced));
    assert_eq!(bench.supervisor.zero_deg(), None);
}

#[test]
fn a_restart_for_another_reason_during_a_stop_loses_the_position() {
    let mut bench = Bench::new();
    bench.supervisor.request_stop(0);
    bench.report("Hold:0", 11.2, 2);
    bench.pass(20);
    bench.hear("Grbl 1.1h ['$' for help] [reset: brown-out]");
    assert_eq!(bench.supervisor.zero_deg(), None);
    bench.report("Idle", 11.2, 2);
    assert!(!bench.supervisor.is_stopping());
}

#[test]
fn nothing_is_sent_while_the_table_is_being_stopped() {
    let mut bench = Bench::new();
    bench.supervisor.request_stop(0);
    let sent = bench.supervisor.send(0, "$X", ReplyTimeout::AtOnce);
    assert_eq!(sent, Err(SendError::Busy));
}

#[test]
fn a_motion_is_over_when_the_table_rests_at_its_target_by_a_report_asked_for_afterwards() {
    let mut bench = Bench::new();
    bench.moving(10.0);
    bench.hear("<Idle|MPos:10.000,0.000,0.000|FS:0,0>");
    assert!(!bench.supervisor.motion().unwrap().is_at_target());
    bench.report("Run", 5.0, 1);
    bench.report("Idle", 9.991, 1);
    assert!(bench.supervisor.motion().unwrap().is_at_target());
    assert_eq!(bench.supervisor.fault(), None);
}

#[test]
fn a_table_that_rests_elsewhere_is_astray_after_a_while() {
    let mut bench = Bench::new();
    bench.moving(10.0);
    bench.report("Idle", 0.0, 5);
    assert_eq!(bench.supervisor.fault(), None);
    bench.report("Idle", 0.0, 5);
    assert!(matches!(
        bench.supervisor.fault(),
        Some(MotionFault::Astray { .. })
    ));
    assert!(bench.supervisor.is_stopping());
}

#[test]
fn a_motion_that_takes_too_long_is_late() {
    let mut bench = Bench::new();
    bench.moving(1000.0);
    for tenth in 0..750 {
        bench.report("Run", f64::from(tenth) / 10.0, 1);
    }
    assert_eq!(bench.supervisor.fault(), None);
    bench.report("Run", 80.0, 1);
    bench.pass(500);
    assert_eq!(bench.supervisor.fault(), Some(&MotionFault::Late));
}

#[test]
fn without_checksums_a_report_counts_when_the_one_before_says_the_same() {
    let mut bench = Bench::new();
    bench.report("Idle", 3.0, 2);
    assert!(bench.supervisor.is_confirmed());
    bench.report("Idle", 673.0, 1);
    assert!(!bench.supervisor.is_confirmed());
    bench.report("Idle", 3.0, 2);
    assert!(bench.supervisor.is_confirmed());
    bench.report("Run", 3.0, 1);
    assert!(!bench.supervisor.is_confirmed());
    bench.report("Run", 4.0, 1);
    assert!(bench.supervisor.is_confirmed());
}

#[test]
fn a_report_that_comes_twice_and_late_is_no_stall() {
    let mut bench = Bench::new();
    bench.moving(10.0);
    bench.report("Run", 5.0, 1);
    bench.now_us += 850_000;
    bench.hear("<Run|MPos:5.000,0.000,0.000|FS:432,0>");
    assert_eq!(bench.supervisor.fault(), None);
    bench.report("Run", 5.0, 12);
    assert!(matches!(
        bench.supervisor.fault(),
        Some(MotionFault::Stalled { .. })
    ));
}

#[test]
fn a_banner_at_rest_loses_the_position_without_stopping_anything() {
    let mut bench = Bench::new();
    bench.hear("Grbl 1.1h ['$' for help]");
    assert_eq!(bench.supervisor.zero_deg(), None);
    assert!(!bench.supervisor.is_stopping());
    assert_eq!(bench.supervisor.restarts(), 1);
}

#[test]
fn a_position_that_jumps_at_rest_without_a_banner_is_lost() {
    let mut bench = Bench::new();
    bench.report("Idle", -200.0, 3);
    assert_eq!(bench.supervisor.zero_deg(), Some(0.0));
    bench.report("Idle", 0.0, 1);
    assert_eq!(bench.supervisor.zero_deg(), Some(0.0), "one may be damaged");
    bench.report("Idle", 0.0, 1);
    assert_eq!(bench.supervisor.zero_deg(), None);
    assert!(bench.supervisor.has_restarted());
}

#[test]
fn a_table_that_is_driven_from_elsewhere_keeps_its_position() {
    let mut bench = Bench::new();
    bench.report("Idle", -200.0, 3);
    bench.report("Jog", -100.0, 2);
    bench.report("Idle", -50.0, 3);
    assert_eq!(bench.supervisor.zero_deg(), Some(0.0));
}

#[test]
fn a_controller_that_counts_itself_as_homed_no_more_has_lost_the_position() {
    let mut bench = Bench::new();
    for homed in [1, 0, 0] {
        bench.pass(80);
        bench.hear(&format!("<Idle|MPos:0.000,0.000,0.000|FS:0,0|H:{homed}>"));
    }
    assert_eq!(bench.supervisor.zero_deg(), None);
}

#[test]
fn while_it_is_homed_a_controller_is_not_homed_and_that_is_no_restart() {
    let mut bench = Bench::new();
    bench.hear("<Idle|MPos:5.000,0.000,0.000|FS:0,0|H:1>");
    bench
        .supervisor
        .begin_motion(bench.now_us, MotionGoal::Homing);
    for at in [5.0, 3.0, -2.0] {
        bench.pass(80);
        bench.hear(&format!("<Home|MPos:{at:.3},0.000,0.000|FS:432,0|H:0>"));
    }
    assert_eq!(bench.supervisor.fault(), None);
    assert_eq!(bench.supervisor.restarts(), 0);
}

#[test]
fn a_motion_that_goes_back_shows_a_restart_and_one_damaged_report_does_not() {
    let mut bench = Bench::new();
    bench.moving(100.0);
    for at in [10.0, 20.0, 90.0, 30.0, 40.0, 0.0, 50.0] {
        bench.report("Run", at, 1);
    }
    assert_eq!(bench.supervisor.fault(), None);
    bench.report("Idle", 0.0, 2);
    assert_eq!(
        bench.supervisor.fault(),
        Some(&MotionFault::Restarted(None))
    );
    assert_eq!(bench.supervisor.zero_deg(), None);
}

#[test]
fn a_reset_that_no_banner_follows_is_done_when_the_table_is_reported_free() {
    let mut bench = Bench::new();
    bench.supervisor.request_stop(0);
    bench.report("Hold:0", 11.2, 2);
    assert!(bench.pass(20).contains(&0x18));
    bench.report("Idle", 11.2, 40);
    assert_eq!(bench.supervisor.stopped(), Some(StopOutcome::Stopped));
    assert_eq!(bench.supervisor.zero_deg(), Some(0.0));
    assert!(
        bench
            .supervisor
            .send(bench.now_us, "$X", ReplyTimeout::AtOnce)
            .is_ok()
    );
}

#[test]
fn an_alarm_comes_with_its_number_or_from_the_pins() {
    let mut bench = Bench::new();
    bench.hear("<Alarm:11|MPos:0.000,0.000,0.000|FS:0,0>");
    let alarm = bench.supervisor.alarm().unwrap();
    assert_eq!((alarm.code, alarm.is_emergency_stop()), (Some(11), false));
    assert_eq!(bench.supervisor.zero_deg(), None);
    for letter in ["R", "E"] {
        let mut bench = Bench::new();
        bench.hear(&format!(
            "<Alarm|MPos:0.000,0.000,0.000|FS:0,0|Pn:{letter}>"
        ));
        bench.hear("<Alarm|MPos:0.000,0.000,0.000|FS:0,0>");
        assert!(bench.supervisor.alarm().unwrap().is_emergency_stop());
        assert_eq!(bench.supervisor.zero_deg(), None);
    }
}
