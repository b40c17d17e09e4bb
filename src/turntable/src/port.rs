//! The serial port: bytes in and out, with a limit on every wait.

use std::fs;
use std::io::{self, Read, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serialport::{SerialPort as _, TTYPort};

use super::error::TurntableError;
use crate::lockfile::{self, LockError, LockFile};

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

/// Makes this process the owner of `port`, without opening it: opening an Arduino's port resets it. The lock
/// is named by the port's device number, so that every name of the port leads to it.
pub(super) fn claim(port: &Path, folder: &Path) -> Result<LockFile, TurntableError> {
    let device = fs::metadata(port).map_err(|source| TurntableError::Open {
        path: port.to_owned(),
        source,
    })?;
    lockfile::use_folder(folder)?;
    LockFile::take(&lock_of(&device, folder), &port.display().to_string()).map_err(|error| {
        match error {
            LockError::Held { pid, .. } => TurntableError::Owned {
                path: port.to_owned(),
                pid: pid.unwrap_or(0),
            },
            error => error.into(),
        }
    })
}

/// Whether a process really has the lock of a port open: the number in a lock file is only what somebody wrote there.
pub(super) fn has_open(pid: u32, port: &Path, folder: &Path) -> bool {
    let lock = fs::metadata(port)
        .map(|device| lock_of(&device, folder))
        .and_then(fs::metadata);
    let files = fs::read_dir(format!("/proc/{pid}/fd"));
    let (Ok(lock), Ok(files)) = (lock, files) else {
        return false;
    };
    files
        .filter_map(|file| fs::metadata(file.ok()?.path()).ok())
        .any(|file| (file.dev(), file.ino()) == (lock.dev(), lock.ino()))
}

fn lock_of(device: &fs::Metadata, folder: &Path) -> PathBuf {
    folder.join(format!("turntable-{:x}.lock", device.rdev()))
}

/// A serial port, opened exclusively.
#[derive(Debug)]
pub struct SerialPort {
    port: TTYPort,
    name: String,
    resets: bool,
}

impl SerialPort {
    /// Opens a port exclusively, at Grbl's baud rate.
    ///
    /// # Errors
    /// [`TurntableError::Open`].
    pub fn open(path: &Path) -> Result<SerialPort, TurntableError> {
        let name = path.display().to_string();
        let settings = serialport::new(name.clone(), BAUD).timeout(WRITE_WAIT);
        let open = |source: serialport::Error| TurntableError::Open {
            path: path.to_owned(),
            source: source.into(),
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
