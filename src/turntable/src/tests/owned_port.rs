//! One process has a port, and says so to others.

use std::io::{Read, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use serialport::{SerialPort as _, TTYPort};

use crate::tests::fake_grbl::FakeGrbl;
use crate::{Table, TableOptions, TurntableError};
use relit_data::clock::Clock;

/// A fake controller at a pseudoterminal.
struct Terminal {
    path: PathBuf,
    quit: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
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
            _slave: slave,
        }
    }

    fn open(&self) -> Result<Table, TurntableError> {
        Table::open_serial(&self.path, &TableOptions::default())
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.quit.store(true, Ordering::Release);
        self.thread.take().unwrap().join().unwrap();
    }
}

#[test]
fn a_port_has_one_owner_until_it_is_closed() {
    let terminal = Terminal::new();
    let table = terminal.open().unwrap();
    match terminal.open().map(|_| ()) {
        Err(TurntableError::Owned { pid, .. }) => assert_eq!(pid, Some(std::process::id())),
        other => panic!("{other:?}"),
    }
    drop(table);
    assert!(terminal.open().is_ok());
}

#[test]
fn a_missing_port_is_named_in_the_error() {
    let options = TableOptions::default();
    let path = PathBuf::from("/dev/there-is-no-such-port");
    let error = Table::open_serial(&path, &options).map(|_| ()).unwrap_err();
    assert!(
        matches!(&error, TurntableError::Open { path: port, .. } if *port == path),
        "{error}"
    );
}
