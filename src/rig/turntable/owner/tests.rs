#![allow(clippy::unwrap_used, reason = "a test's own mistakes should be loud")]

use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use serialport::{SerialPort as _, TTYPort};

use super::claim::Files;
use super::*;
use crate::clock::Clock;
use crate::lockfile::tests::accounts::{OPERATOR, OUTSIDER, SERVICE, as_user, share};
use crate::turntable::tests::fake_grbl::FakeGrbl;
use crate::turntable::{ControllerState, MotionFault, Table, TableOptions, TurntableError};

/// A fake controller at a pseudoterminal.
struct Terminal {
    path: PathBuf,
    quit: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    runtime: tempfile::TempDir,
    // Kept open, so that the other end sees no hang-up between two openings.
    _slave: TTYPort,
}

impl Terminal {
    fn new() -> Terminal {
        let (mut master, slave) = TTYPort::pair().unwrap();
        master.set_timeout(Duration::from_millis(1)).unwrap();
        let path = PathBuf::from(slave.name().unwrap());
        let quit = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&quit);
        let thread = thread::spawn(move || {
            let (clock, mut fake_grbl) = (Clock::monotonic(), FakeGrbl::new(true));
            let mut buffer = [0; 256];
            while !flag.load(Ordering::Acquire) {
                let count = master.read(&mut buffer).unwrap_or(0);
                fake_grbl.advance(clock.now_us());
                fake_grbl.take(&buffer[..count]);
                master.write_all(&fake_grbl.give()).unwrap();
            }
        });
        Terminal {
            path,
            quit,
            thread: Some(thread),
            runtime: tempfile::tempdir().unwrap(),
            _slave: slave,
        }
    }

    fn open(&self) -> Result<Table, TurntableError> {
        let options = TableOptions {
            runtime_folder: self.runtime.path().to_owned(),
            ..TableOptions::default()
        };
        Table::open_serial(&self.path, &options)
    }

    fn owner(&self) -> Option<Owner> {
        Owner::find(&self.path, self.runtime.path()).unwrap()
    }

    fn files(&self) -> Files {
        Files::of(&self.path, self.runtime.path()).unwrap()
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.quit.store(true, Ordering::Release);
        self.thread.take().unwrap().join().unwrap();
    }
}

#[test]
fn a_port_has_one_owner_that_answers_until_it_is_closed() {
    let terminal = Terminal::new();
    assert!(terminal.owner().is_none());
    let table = terminal.open().unwrap();
    let owner = terminal.owner().unwrap();
    assert_eq!(owner.pid(), std::process::id());
    assert_eq!(owner.status().unwrap().state, ControllerState::Idle);
    match terminal.open().map(|_| ()) {
        Err(TurntableError::Owned { pid, .. }) => assert_eq!(pid, std::process::id()),
        other => panic!("{other:?}"),
    }
    drop(table);
    assert!(terminal.owner().is_none());
    assert!(terminal.open().is_ok());
}

fn stop_once_it_moves(owner: &Owner) -> TableStatus {
    // A jog that ends by itself fails the test.
    while !owner.status().unwrap().state.may_move() {}
    owner.stop().unwrap()
}

#[test]
fn a_stop_requested_from_the_owner_stops_the_table_and_ends_its_motion() {
    let terminal = Terminal::new();
    let table = terminal.open().unwrap();
    let owner = terminal.owner().unwrap();
    let stopper = thread::spawn(move || stop_once_it_moves(&owner));
    let error = table.jog(300.0, Some(1.0)).unwrap_err();
    assert!(
        matches!(error, TurntableError::Motion(MotionFault::Stopped)),
        "{error}"
    );
    let stopped = stopper.join().unwrap();
    assert!(!stopped.state.may_move() && stopped.angle_deg < 299.0);
}

#[test]
fn lock_and_socket_of_a_killed_owner_belong_to_nobody() {
    let terminal = Terminal::new();
    let files = terminal.files();
    std::fs::write(&files.lock, "4194304").unwrap();
    drop(std::os::unix::net::UnixListener::bind(&files.socket).unwrap());
    assert!(files.socket.exists());
    assert!(terminal.owner().is_none());
    let _table = terminal.open().unwrap();
    assert_eq!(
        terminal.owner().unwrap().status().unwrap().state,
        ControllerState::Idle
    );
}

#[test]
fn a_bad_or_a_silent_client_does_not_affect_others() {
    let terminal = Terminal::new();
    let _table = terminal.open().unwrap();
    let socket = terminal.files().socket;
    let silent = UnixStream::connect(&socket).unwrap();
    let mut rude = UnixStream::connect(&socket).unwrap();
    rude.write_all(b"\"home\"\n").unwrap();
    let mut answer = String::new();
    rude.read_to_string(&mut answer).unwrap();
    assert!(answer.contains("error"), "{answer}");
    assert!(terminal.owner().unwrap().status().is_ok());
    drop(silent);
}

#[test]
fn a_folder_that_others_can_write_in_is_not_used() {
    use std::os::unix::fs::PermissionsExt;
    let terminal = Terminal::new();
    let open = std::fs::Permissions::from_mode(0o777);
    std::fs::set_permissions(terminal.runtime.path(), open).unwrap();
    assert!(matches!(
        terminal.open().map(|_| ()),
        Err(TurntableError::Lock(_))
    ));
}

#[test]
fn an_operator_asks_and_stops_the_table_of_a_service_and_an_outsider_opens_nothing() {
    let terminal = Terminal::new();
    if !share(terminal.runtime.path()) {
        return;
    }
    std::os::unix::fs::chown(&terminal.path, Some(SERVICE), None).unwrap();
    let table = as_user(SERVICE, || terminal.open()).unwrap();
    as_user(OPERATOR, || {
        let owner = terminal.owner().unwrap();
        assert_eq!(owner.status().unwrap().state, ControllerState::Idle);
        let opened = terminal.open().map(|_| ());
        assert!(
            matches!(opened, Err(TurntableError::Owned { .. })),
            "{opened:?}"
        );
    });
    let error = thread::scope(|scope| {
        let moving = scope.spawn(|| table.jog(300.0, Some(1.0)).unwrap_err());
        as_user(OPERATOR, || stop_once_it_moves(&terminal.owner().unwrap()));
        moving.join().unwrap()
    });
    assert!(
        matches!(error, TurntableError::Motion(MotionFault::Stopped)),
        "{error}"
    );
    as_user(OUTSIDER, || {
        let found = Owner::find(&terminal.path, terminal.runtime.path());
        assert!(matches!(found, Err(TurntableError::Lock(_))), "{found:?}");
        let opened = terminal.open().map(|_| ());
        assert!(matches!(opened, Err(TurntableError::Lock(_))), "{opened:?}");
    });
}

#[test]
fn a_missing_port_is_named_in_the_error() {
    let options = TableOptions::default();
    let path = PathBuf::from("/dev/there-is-no-such-port");
    let error = Table::open_serial(&path, &options).map(|_| ()).unwrap_err();
    assert!(
        error.to_string().contains("/dev/there-is-no-such-port"),
        "{error}"
    );
}
