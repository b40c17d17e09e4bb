//! The rig as a daemon: commands, and what comes back by itself.

use std::path::Path;
use std::time::{Duration, Instant};

use relit_capture::capture::{CaptureError, Settings, StopReason};
use relit_capture::command::{Command, CommandError, Rig};
use relit_capture::daemon::Daemon;
use relit_capture::state::{LogLine, Phase, RigState, Verdict};
use relit_data::causes::with_causes;
use relit_data::session::{Manifest, SessionWriter};
use relit_tests::is_named;
use relit_turntable::SerialPort;

use crate::support::{SHORT, fixture};

/// Longest time between two looks at the state.
const ASKED_EVERY: Duration = Duration::from_millis(100);

fn settings(root: &Path, camera: &str, table: &str) -> Settings {
    let camera = format!("replay:{}?loop=1{camera}", fixture(SHORT).display());
    let mut settings = Settings::new(
        root.to_owned(),
        camera.parse().unwrap(),
        table.parse().unwrap(),
    );
    settings.degrees_per_second = 36.0;
    settings.retries = 0;
    settings
}

/// Longest wait for anything, on a machine that is busy with something else.
const LONG: Duration = Duration::from_secs(300);

/// The state once it is as `wanted`.
fn once(daemon: &Daemon, mut wanted: impl FnMut(&RigState) -> bool) -> RigState {
    let until = Instant::now() + LONG;
    let mut state = daemon.monitor().state();
    while !wanted(&state) {
        assert!(Instant::now() < until, "{state:#?}");
        // What is wanted may also come true without a change of the state.
        state = daemon.monitor().wait_newer(state.version, ASKED_EVERY);
    }
    state
}

fn start(object: &str) -> Command {
    Command::Start {
        object: object.to_owned(),
    }
}

/// Whether the simulated table makes steps.
fn moves(daemon: &Daemon) -> bool {
    let table = daemon.simulator().unwrap();
    let before = table.edges().len();
    std::thread::sleep(ASKED_EVERY);
    table.edges().len() > before
}

fn is_ready(state: &RigState) -> bool {
    state.camera.present && state.table.present
}

#[test]
fn an_object_is_captured_and_a_second_start_is_refused() {
    let root = tempfile::tempdir().unwrap();
    let daemon = Daemon::start(settings(root.path(), "", "sim:?speed=3"), || ()).unwrap();
    once(&daemon, is_ready);
    once(&daemon, |state| state.camera.focus.is_some());
    once(&daemon, |_| daemon.monitor().preview().is_some());
    daemon.command(start("mug")).unwrap();
    let again = daemon.command(start("mug")).unwrap_err();
    assert!(matches!(again, CommandError::Busy(_)), "{again}");
    let state = once(&daemon, |state| {
        state.last_take.is_some() && state.phase == Phase::Idle
    });
    let take = state.last_take.unwrap();
    assert_eq!(take.verdict, Verdict::Clean, "{take:?}");
    assert!(take.session.ends_with("-mug"));
}

#[test]
fn the_stop_of_a_take_does_not_reach_the_next_job() {
    let root = tempfile::tempdir().unwrap();
    let mut settings = settings(root.path(), "", "none");
    // The take is stopped in its middle: it lasts until then, however late that is.
    settings.degrees_per_second = 1.0;
    let daemon = Daemon::start(settings, || ()).unwrap();
    once(&daemon, |state| state.camera.present);
    daemon.command(start("mug")).unwrap();
    once(&daemon, |state| state.frames > 5);
    daemon.command(Command::Stop).unwrap();
    let state = once(&daemon, |state| state.phase == Phase::Idle);
    let take = state.last_take.unwrap();
    assert_eq!((take.verdict, take.is_stopped), (Verdict::Aborted, true));
    assert!(state.faults.is_empty(), "{:?}", state.faults);
    once(&daemon, |_| daemon.command(start("mug")).is_ok());
    once(&daemon, |state| {
        state.phase == Phase::Recording && state.frames > 5
    });
}

#[test]
fn a_stop_reaches_a_jog_and_an_end_reaches_a_take() {
    let root = tempfile::tempdir().unwrap();
    let daemon = Daemon::start(settings(root.path(), "", "sim:?speed=1"), || ()).unwrap();
    once(&daemon, is_ready);
    daemon.command(Command::Jog { degrees: 390.0 }).unwrap();
    once(&daemon, |_| moves(&daemon));
    daemon.command(Command::Stop).unwrap();
    once(&daemon, |state| state.phase == Phase::Idle);
    let is_noted = |line: &LogLine| line.what == StopReason::Person.to_string();
    let state = once(&daemon, |state| state.log.iter().any(is_noted));
    assert!(state.faults.is_empty(), "{:?}", state.faults);
    once(&daemon, |state| state.table.state == "Idle");
    assert!(!moves(&daemon));

    once(&daemon, |_| daemon.command(start("mug")).is_ok());
    once(&daemon, |state| state.frames > 20);
    daemon.end();
    let take = daemon.monitor().state().last_take.unwrap();
    assert_eq!(take.verdict, Verdict::Aborted);
    let reason = take.reason.unwrap();
    assert!(
        reason.contains(&StopReason::Shutdown.to_string()),
        "{reason}"
    );
    assert!(daemon.command(start("mug")).is_err());
}

#[test]
fn a_camera_that_was_unplugged_comes_back_without_a_restart() {
    let root = tempfile::tempdir().unwrap();
    let daemon = Daemon::start(settings(root.path(), "&unplug=60", "sim:?speed=3"), || ()).unwrap();
    once(&daemon, |state| state.camera.present);
    // It may be back before anybody looks.
    once(&daemon, |state| {
        let mut faults = state.faults.iter();
        faults.any(|fault| fault.what.contains(SHORT))
    });
    once(&daemon, |state| {
        state.camera.present && state.camera.fault.is_none()
    });
}

#[test]
fn a_fault_is_shown_with_its_cause() {
    let root = tempfile::tempdir().unwrap();
    let daemon = Daemon::start(settings(root.path(), "", "serial:/dev/null"), || ()).unwrap();
    let state = once(&daemon, |state| state.table.fault.is_some());
    let fault = state.table.fault.unwrap();
    let cause = SerialPort::open(Path::new("/dev/null")).unwrap_err();
    assert!(fault.contains(&with_causes(&cause)), "{fault}");
    once(&daemon, |state| {
        state.faults.iter().any(|line| line.what == fault)
    });
}

#[test]
fn a_second_daemon_is_refused_with_the_process_that_has_the_folder() {
    let root = tempfile::tempdir().unwrap();
    let _first = Daemon::start(settings(root.path(), "", "none"), || ()).unwrap();
    let error = Daemon::start(settings(root.path(), "", "none"), || ()).unwrap_err();
    let CaptureError::InUse { pid, .. } = error else {
        panic!("{error}");
    };
    assert_eq!(pid, Some(std::process::id()));
}

#[test]
fn a_session_whose_recorder_died_is_recovered_at_the_start_and_told() {
    let root = tempfile::tempdir().unwrap();
    let json = std::fs::read(fixture(SHORT).join("session.json")).unwrap();
    let manifest = Manifest::from_json(&json).unwrap();
    drop(SessionWriter::create(root.path(), manifest).unwrap());
    let daemon = Daemon::start(settings(root.path(), "", "none"), || ()).unwrap();
    let faults = daemon.monitor().state().faults;
    assert_eq!(faults.len(), 1, "{faults:?}");
    assert!(faults[0].what.contains(SHORT), "{faults:?}");
}

#[test]
fn commands_that_make_no_sense_are_refused_where_they_are_given() {
    let root = tempfile::tempdir().unwrap();
    let daemon = Daemon::start(settings(root.path(), "", "none"), || ()).unwrap();
    let refused = |command: Command| daemon.command(command).unwrap_err();
    assert!(matches!(refused(start("a/b")), CommandError::Invalid(_)));
    assert!(matches!(
        refused(Command::Home),
        CommandError::Unavailable(_)
    ));
    assert!(matches!(
        refused(Command::Jog { degrees: f64::NAN }),
        CommandError::Invalid(_)
    ));
}

#[test]
fn a_table_without_an_index_says_what_to_do_until_its_zero_is_set() {
    let root = tempfile::tempdir().unwrap();
    let daemon = Daemon::start(settings(root.path(), "", "sim:?speed=3"), || ()).unwrap();
    let table = once(&daemon, is_ready).table;
    assert!(!table.has_index && !table.homed, "{table:?}");
    assert!(table.fault.is_some(), "{table:?}");
    // It is a warning: a person may know that the cable hangs free.
    assert!(Command::check(&start("mug"), &daemon.monitor().state()).is_ok());
    daemon.command(Command::Home).unwrap();
    let table = once(&daemon, |state| state.table.homed).table;
    assert_eq!(table.fault, None);
}

/// Presses the emergency stop while the table moves.
fn press_in_motion(daemon: &Daemon) -> RigState {
    daemon.command(Command::Jog { degrees: 390.0 }).unwrap();
    once(daemon, |_| moves(daemon));
    daemon.simulator().unwrap().press_emergency_stop(true);
    once(daemon, |state| state.table.emergency_stop)
}

#[test]
fn after_an_emergency_stop_one_command_brings_the_table_back() {
    let root = tempfile::tempdir().unwrap();
    let daemon = Daemon::start(settings(root.path(), "", "sim:?speed=3"), || ()).unwrap();
    once(&daemon, is_ready);
    let state = press_in_motion(&daemon);
    let pressed = state.table.fault.unwrap();
    for command in [
        start("mug"),
        Command::Home,
        Command::Reset,
        Command::Jog { degrees: 5.0 },
    ] {
        let refused = daemon.command(command).unwrap_err();
        assert_eq!(refused, CommandError::Unavailable(pressed.clone()));
    }
    daemon.simulator().unwrap().press_emergency_stop(false);
    let state = once(&daemon, |state| !state.table.emergency_stop);
    assert!(
        state.table.locked && !state.table.homed,
        "{:?}",
        state.table
    );
    // Nothing moves before a person has looked at the table.
    once(&daemon, |state| state.phase == Phase::Idle);
    let refused = daemon.command(start("mug")).unwrap_err();
    assert!(
        matches!(&refused, CommandError::Unavailable(why) if *why != pressed),
        "{refused}"
    );
    // The jog that was interrupted is still being wound up.
    let faults = daemon.monitor().state().faults.len();
    once(&daemon, |_| daemon.command(Command::Reset).is_ok());
    once(&daemon, |state| {
        state.table.homed && state.table.state == "Idle"
    });
    // Nobody has seen yet whether its cable is wound.
    once(&daemon, |state| state.faults.len() > faults);
    once(&daemon, |_| daemon.command(start("mug")).is_ok());
    let state = once(&daemon, |state| state.last_take.is_some());
    assert_eq!(state.last_take.unwrap().verdict, Verdict::Clean);
}

#[test]
fn a_speed_that_the_table_does_not_reach_is_refused_before_start() {
    let root = tempfile::tempdir().unwrap();
    let mut settings = settings(root.path(), "", "sim:?speed=20");
    settings.degrees_per_second = 72.0;
    let daemon = Daemon::start(settings, || ()).unwrap();
    let state = once(&daemon, is_ready);
    assert_eq!(state.table.max_degrees_per_second, Some(36.0));
    let refused = daemon.command(start("mug")).unwrap_err();
    assert!(
        matches!(&refused, CommandError::Unavailable(why) if is_named(why, &["36", "72"])),
        "{refused}"
    );
    let advice = daemon.monitor().state().advice;
    assert!(advice.button.action.is_none(), "{advice:?}");
}
