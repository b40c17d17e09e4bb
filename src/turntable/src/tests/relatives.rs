//! Grbl's relatives: each works, and none makes the table believe in a position that is lost.

use super::fake_grbl::Dialect;
use super::*;

fn opened(dialect: Dialect) -> Rig {
    open(FakeGrbl::relative(dialect))
}

/// Opened, homed and turned to -200 degrees.
fn at_minus_200(dialect: Dialect) -> Rig {
    let rig = opened(dialect);
    rig.table.home().unwrap();
    let status = rig.table.jog(-200.0, None).unwrap();
    assert!((status.angle_deg + 200.0).abs() < 0.02, "{status:?}");
    rig
}

/// Restarts the controller at rest.
fn restart(rig: &Rig) {
    rig.set(|trouble, now| trouble.reset_at_us = Some(now));
    rig.table.clock().sleep(Duration::from_millis(100));
}

#[test]
fn each_is_known_by_what_it_says_of_itself() {
    let families = [
        (Dialect::Grbl, Family::Grbl),
        (Dialect::GrblHal, Family::GrblHal),
        (Dialect::FluidNc, Family::FluidNc),
        (Dialect::GrblEsp32, Family::GrblEsp32),
        (Dialect::WithoutBanner, Family::FluidNc),
    ];
    for (dialect, family) in families {
        let rig = opened(dialect);
        let identity = rig.table.identity();
        assert_eq!(identity.family, family);
        assert!(!identity.extras && rig.table.counts().noise <= 1);
    }
}

#[test]
fn each_turns_and_stops_in_the_middle_with_its_position() {
    for dialect in Dialect::RELATIVES {
        let rig = opened(dialect);
        rig.table.home().unwrap();
        rig.turn(30.0).wait_end().unwrap();
        let mut turn = rig.turn(90.0);
        turn.wait_constant().unwrap();
        let status = turn.abort().unwrap();
        assert!(status.homed, "{dialect:?} {status:?}");
        let after = rig.table.jog(1.0, None).unwrap();
        let gone = after.angle_deg - status.angle_deg;
        assert!((gone - 1.0).abs() < 0.03, "{dialect:?} {gone}");
    }
}

#[test]
fn after_a_restart_at_rest_the_position_is_lost_whatever_the_banner_says() {
    for dialect in Dialect::RELATIVES.into_iter().chain([Dialect::Grbl]) {
        let rig = at_minus_200(dialect);
        assert!(rig.table.status().unwrap().homed);
        restart(&rig);
        let status = rig.table.status().unwrap();
        assert!(!status.homed && status.restarted, "{dialect:?} {status:?}");
        rig.table.home().unwrap();
        let status = rig.table.status().unwrap();
        assert!(status.homed && !status.restarted, "{dialect:?}");
    }
}

#[test]
fn a_turn_that_was_planned_before_a_restart_does_not_begin() {
    for dialect in Dialect::RELATIVES {
        let rig = at_minus_200(dialect);
        let plan = rig.plan(90.0);
        restart(&rig);
        let error = rig.table.start_turn(plan).map(|_| ()).unwrap_err();
        assert!(matches!(error, TurntableError::NotHomed), "{error}");
        assert_eq!(rig.fake_grbl.lock().unwrap().at, 0.0, "{dialect:?}");
    }
}

#[test]
fn a_table_whose_controller_restarts_at_a_turns_end_does_not_turn_back() {
    for dialect in Dialect::RELATIVES {
        let rig = at_minus_200(dialect);
        let (_, finished) = rig.turn(30.0).wait_rest();
        restart(&rig);
        let error = finished.unwind().unwrap_err();
        let restarted = matches!(error, TurntableError::Motion(MotionFault::Restarted(None)));
        assert!(restarted, "{dialect:?} {error}");
        assert_eq!(rig.fake_grbl.lock().unwrap().at, 0.0, "{dialect:?}");
    }
}

#[test]
fn a_restart_in_motion_is_named_and_loses_the_position() {
    for dialect in Dialect::RELATIVES {
        for degrees in [100.0, 300.0] {
            let rig = at_minus_200(dialect);
            // Half way away from machine zero, and past it.
            rig.set(|trouble, now| trouble.reset_at_us = Some(now + 3_500_000));
            let error = rig.table.jog(degrees, Some(20.0)).unwrap_err();
            let restarted = matches!(error, TurntableError::Motion(MotionFault::Restarted(_)));
            assert!(restarted, "{dialect:?} {error}");
            let status = rig.table.status().unwrap();
            assert!(!status.homed && status.restarted, "{dialect:?} {status:?}");
        }
    }
}

#[test]
fn a_position_that_one_damaged_report_shows_is_not_believed() {
    let rig = at_minus_200(Dialect::FluidNc);
    rig.table.status().unwrap();
    rig.set(|trouble, _| trouble.wrong_report = Some(0.0));
    let status = rig.table.status().unwrap();
    assert!(status.homed && status.angle_deg < -199.0, "{status:?}");
    rig.set(|trouble, _| trouble.wrong_report = Some(0.0));
    rig.table.jog(10.0, None).unwrap();
    assert!(rig.table.status().unwrap().homed);
}

#[test]
fn an_alarm_has_the_number_of_the_report_and_its_firmware() {
    let rig = at_minus_200(Dialect::GrblHal);
    rig.set(|trouble, now| trouble.alarm_at_us = Some((now, 17)));
    rig.table.clock().sleep(Duration::from_millis(100));
    let status = rig.table.status().unwrap();
    let alarm = status.alarm.unwrap();
    assert_eq!((alarm.code, alarm.family), (Some(17), Family::GrblHal));
    assert!(!status.homed, "{alarm}");
    assert_eq!(rig.table.unlock().unwrap().state, ControllerState::Idle);
}

#[test]
fn a_refusal_in_words_has_grbls_number() {
    let rig = at_minus_200(Dialect::FluidNc);
    rig.set(|trouble, now| trouble.alarm_at_us = Some((now, 3)));
    rig.table.clock().sleep(Duration::from_millis(100));
    let refused = rig.table.command("G1X1F10").unwrap_err();
    assert!(
        matches!(refused, TurntableError::Refused { code: 9, .. }),
        "{refused}"
    );
}

#[test]
fn settings_that_are_not_reported_are_named() {
    let mut fake_grbl = FakeGrbl::relative(Dialect::FluidNc);
    fake_grbl.trouble.lose_setting = Some("$120=");
    let error = try_open(fake_grbl).map(|_| ()).unwrap_err();
    let missing = matches!(&error, TurntableError::NotReported(what)
        if what.contains("$120"));
    assert!(missing, "{error}");
}
