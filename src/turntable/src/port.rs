//! The serial port: bytes in and out, with a limit on every wait.

use std::fs;
use std::io::{self, Read, Write};
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::Duration;

use serialport::{SerialPort as _, TTYPort};

use super::error::TurntableError;

/// Grbl's baud rate, bits/s.
const BAUD: u32 = 115_200;
/// Longest time of one write; after it the port counts as lost.
const WRITE_WAIT: Duration = Duration::from_millis(500);

/// A byte stream to a controller. Reads and writes return within a limited time.
pub trait Port: Send + 'static {
    /// Reads the bytes that are there. If there are none, waits at most `wait` for the first one;
    /// returns 0 if none came.
    ///
    /// # Errors
    /// The port is gone.
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize>;

    /// Writes all of `bytes`, or fails within a second.
    ///
    /// # Errors
    /// The port is gone or accepts nothing.
    fn write(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Its name, for messages.
    fn name(&self) -> String;

    /// Whether opening it may have reset the controller, as an Arduino's USB side does.
    fn resets(&self) -> bool;
}

/// The number of a process that has a file open, as far as this account may see it; of several, one of this program.
pub fn holder(file: &Path) -> Option<u32> {
    let file = fs::metadata(file).ok()?;
    let has_open = |pid: &u32| {
        let files = fs::read_dir(format!("/proc/{pid}/fd"))
            .into_iter()
            .flatten();
        let mut files = files.filter_map(|open| fs::metadata(open.ok()?.path()).ok());
        files.any(|open| (open.dev(), open.ino()) == (file.dev(), file.ino()))
    };
    let processes = fs::read_dir("/proc").ok()?.flatten();
    let pids = processes.filter_map(|process| process.file_name().to_str()?.parse().ok());
    pids.filter(has_open).min_by_key(|&pid| !is_ours(pid))
}

/// Whether a process is one of this program.
pub(super) fn is_ours(pid: u32) -> bool {
    let name = |pid| fs::read(format!("/proc/{pid}/comm")).ok();
    name(pid).is_some_and(|theirs| name(std::process::id()) == Some(theirs))
}

/// A serial port, opened exclusively.
#[derive(Debug)]
pub struct SerialPort {
    port: TTYPort,
    name: String,
    resets: bool,
}

impl SerialPort {
    /// Opens a port exclusively, at Grbl's baud rate. An Arduino's port that its owner has open is not reset by that.
    ///
    /// # Errors
    /// [`TurntableError::Owned`] if another process has it, or [`TurntableError::Open`].
    pub fn open(path: &Path) -> Result<SerialPort, TurntableError> {
        let name = path.display().to_string();
        let settings = serialport::new(name.clone(), BAUD).timeout(WRITE_WAIT);
        let open = |source: serialport::Error| match source.kind() {
            // The library's word for a port that is locked.
            serialport::ErrorKind::NoDevice => TurntableError::Owned {
                path: path.to_owned(),
                pid: holder(path),
            },
            _ => TurntableError::Open {
                path: path.to_owned(),
                source: source.into(),
            },
        };
        let mut port = TTYPort::open(&settings).map_err(open)?;
        // A port without modem lines, such as a pseudoterminal, cannot reset the controller.
        let resets = port.read_clear_to_send().is_ok();
        Ok(SerialPort { port, name, resets })
    }
}

impl Port for SerialPort {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        self.port.set_timeout(wait)?;
        match self.port.read(buffer) {
            Ok(0) => Err(io::Error::from(io::ErrorKind::UnexpectedEof)),
            Err(error) if is_nothing(&error) => Ok(0),
            read => read,
        }
    }

    fn write(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        self.port.set_timeout(WRITE_WAIT)?;
        while !bytes.is_empty() {
            match self.port.write(bytes) {
                Ok(0) => return Err(io::Error::from(io::ErrorKind::WriteZero)),
                Ok(written) => bytes = bytes.get(written..).unwrap_or_default(),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    fn name(&self) -> String {
        self.name.clone()
    }

    fn resets(&self) -> bool {
        self.resets
    }
}

fn is_nothing(error: &io::Error) -> bool {
    let kinds = [
        io::ErrorKind::TimedOut,
        io::ErrorKind::Interrupted,
        io::ErrorKind::WouldBlock,
    ];
    kinds.contains(&error.kind())
}
