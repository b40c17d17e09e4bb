//! The emergency stop, pressed and released while a host has the table.

use std::time::Duration;

use relit_turntable::{
    Alarm, ControllerState, HomingResult, MotionFault, Port, Table, TurntableError,
};

use crate::rig::{Rig, turn_by};

/// A table whose emergency stop was pressed in the middle of a turn, and is still.
fn pressed_in_a_turn() -> (Rig, Table) {
    let rig = Rig::new("");
    let table = rig.open();
    table.home().unwrap();
    let mut turn = table.start_turn(turn_by(&table, 90.0)).unwrap();
    turn.wait_constant().unwrap();
    rig.simulated.press_emergency_stop(true);
    let error = turn.wait_end().unwrap_err();
    let alarm = |error: &TurntableError| match error {
        TurntableError::Motion(MotionFault::Alarm(alarm)) => alarm.code,
        _ => None,
    };
    assert_eq!(alarm(&error), Some(10), "{error}");
    (rig, table)
}

fn assert_turns_again(table: &Table) {
    let status = table.status().unwrap();
    assert_eq!((status.state, status.homed), (ControllerState::Idle, true));
    table
        .start_turn(turn_by(table, 90.0))
        .unwrap()
        .wait_end()
        .unwrap();
}

#[test]
fn while_the_emergency_stop_is_pressed_everything_says_so() {
    let (_rig, table) = pressed_in_a_turn();
    for error in [
        table.unlock().unwrap_err(),
        table.home().unwrap_err(),
        table.reset().unwrap_err(),
        table.jog(1.0, None).unwrap_err(),
    ] {
        assert!(matches!(error, TurntableError::EmergencyStop), "{error}");
    }
    // A stop is no way out of it either, and does no harm.
    table.stop().unwrap();
    let status = table.status().unwrap();
    assert!(status.emergency_stop && !status.homed);
    assert!(status.alarm.is_some_and(Alarm::is_emergency_stop));
}

#[test]
fn a_table_that_starts_with_the_emergency_stop_pressed_says_so() {
    let rig = Rig::new("estop@0s");
    let table = rig.open();
    let error = table.unlock().unwrap_err();
    assert!(matches!(error, TurntableError::EmergencyStop), "{error}");
}

type WayOut = fn(&Table) -> Result<(), TurntableError>;

#[test]
fn after_the_release_reset_and_also_unlock_and_home_bring_the_table_back() {
    let ways: [WayOut; 2] = [
        |table| {
            assert_eq!(table.reset()?, HomingResult::WhereItStands);
            Ok(())
        },
        |table| {
            table.unlock()?;
            table.home()?;
            Ok(())
        },
    ];
    for way_out in ways {
        let (rig, table) = pressed_in_a_turn();
        // The host may have reset the controller in vain while the button was down.
        let _refused = table.reset();
        rig.simulated.press_emergency_stop(false);
        let status = table.status().unwrap();
        let stopped = status.alarm.is_some_and(Alarm::is_emergency_stop);
        assert!(stopped, "{status:?}");
        way_out(&table).unwrap();
        assert_turns_again(&table);
    }
}

#[test]
fn a_table_with_an_index_is_reset_unlocked_and_homed_to_it() {
    let rig = Rig::new("");
    let mut port = rig.simulated.open();
    rig.options.clock.sleep(Duration::from_secs(1));
    port.write(b"$22=1\n").unwrap();
    rig.options.clock.sleep(Duration::from_secs(1));
    drop(port);
    let table = rig.open();
    assert_eq!(table.home().unwrap(), HomingResult::Index);
    rig.simulated.press_emergency_stop(true);
    rig.options.clock.sleep(Duration::from_millis(200));
    assert!(table.status().unwrap().emergency_stop);
    rig.simulated.press_emergency_stop(false);
    assert_eq!(table.reset().unwrap(), HomingResult::Index);
    assert_turns_again(&table);
}
