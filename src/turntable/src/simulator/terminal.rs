//! The pseudoterminal in place of the serial port.

use std::os::fd::OwnedFd;
use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};

use rustix::fs::{Mode, OFlags, fcntl_getfl, fcntl_setfl, open};
use rustix::io::{Errno, FdFlags, fcntl_setfd};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

use super::SimulatorError;
use super::open_counter::OpenCounter;

/// The chip's end of the serial line.
pub(super) struct Terminal {
    line: OwnedFd,
    openings: OpenCounter,
    path: PathBuf,
    /// No process has the port open.
    closed: bool,
}

impl Terminal {
    pub(super) fn open() -> Result<Terminal, SimulatorError> {
        let failed = |step| {
            move |errno: Errno| {
                SimulatorError(format!(
                    "could not {step} a pseudoterminal: {errno}; check that /dev/pts is mounted and not full"
                ))
            }
        };
        let line = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).map_err(failed("open"))?;
        fcntl_setfd(&line, FdFlags::CLOEXEC).map_err(failed("set up"))?;
        grantpt(&line).map_err(failed("grant"))?;
        unlockpt(&line).map_err(failed("unlock"))?;
        let name = ptsname(&line, Vec::new()).map_err(failed("name"))?;
        let path = PathBuf::from(std::ffi::OsString::from_vec(name.into_bytes()));
        let flags = fcntl_getfl(&line).map_err(failed("set up"))?;
        fcntl_setfl(&line, flags | OFlags::NONBLOCK).map_err(failed("set up"))?;
        // Reads report that no process has the port open only after it was opened and closed once.
        let port = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        let port = open(&path, port, Mode::empty()).map_err(failed("try"))?;
        // Without raw mode, the system would echo to the chip what it sends before a host has set up
        // the line.
        let mut modes = tcgetattr(&port).map_err(failed("set up"))?;
        modes.make_raw();
        tcsetattr(&port, OptionalActions::Now, &modes).map_err(failed("set up"))?;
        drop(port);
        let openings = OpenCounter::watch(&path).map_err(failed("watch"))?;
        Ok(Terminal {
            line,
            openings,
            path,
            closed: true,
        })
    }

    /// Path of the port that a host opens.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// How many times the port was opened since the last call.
    pub(super) fn opened(&mut self) -> u64 {
        self.openings.count(self.closed)
    }

    /// Reads what the host has written, up to the size of the buffer.
    pub(super) fn read<'a>(&mut self, buffer: &'a mut [u8]) -> &'a [u8] {
        let count = match rustix::io::read(&self.line, &mut *buffer) {
            Ok(count) => Some(count),
            Err(Errno::AGAIN | Errno::INTR) => Some(0),
            Err(_) => None,
        };
        self.closed = count.is_none();
        buffer.get(..count.unwrap_or(0)).unwrap_or(&[])
    }

    /// Sends bytes to the host. They are lost if no process has the port open, or if its buffer is
    /// full.
    pub(super) fn write(&self, mut bytes: &[u8]) {
        while !self.closed && !bytes.is_empty() {
            match rustix::io::write(&self.line, bytes) {
                Ok(count) if count > 0 => bytes = bytes.get(count..).unwrap_or(&[]),
                Err(Errno::INTR) => {}
                Ok(_) | Err(_) => break,
            }
        }
    }
}
