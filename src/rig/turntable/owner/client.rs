//! The client: sends requests to a port's owner.

use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use relit_data::causes::with_causes;

use super::claim::Files;
use super::{Answer, Question};
use crate::lockfile::LockFile;
use crate::turntable::error::TurntableError;
use crate::turntable::status::TableStatus;

/// How long an owner that is opening its port may take until its socket exists.
const OPENING: Duration = Duration::from_secs(15);
/// How long a socket may refuse this account: its owner makes it first and shares it then.
const SHARING: Duration = Duration::from_secs(1);
const PAUSE: Duration = Duration::from_millis(100);
/// How long an answer may take: a stop takes many seconds.
const ANSWER: Duration = Duration::from_secs(25);
/// Longest answer, bytes.
const LONGEST: u64 = 65_536;

/// The process that owns a port.
#[derive(Debug, Clone)]
pub struct Owner {
    files: Files,
    pid: u32,
}

impl Owner {
    /// The owner of `port`, if it has one. Reads the lock and does not open the port.
    ///
    /// # Errors
    /// [`TurntableError::Open`] if there is no such port, [`TurntableError::Lock`] if it cannot be
    /// known whether it has an owner: then nobody may open it either.
    pub fn find(port: &Path, runtime_folder: &Path) -> Result<Option<Owner>, TurntableError> {
        let files = Files::of(port, runtime_folder)?;
        let holder = LockFile::holder(&files.lock)?;
        Ok(holder.map(|holder| Owner {
            files,
            pid: holder.pid.unwrap_or(0),
        }))
    }

    /// Its process id.
    #[must_use]
    pub fn pid(&self) -> u32 {
        self.pid
    }

    /// Requests the table's status.
    ///
    /// # Errors
    /// [`TurntableError::Owner`] if it does not answer or reports an error.
    pub fn status(&self) -> Result<TableStatus, TurntableError> {
        self.ask(Question::Status)
    }

    /// Requests a stop, and waits until the table stands.
    ///
    /// # Errors
    /// As [`Owner::status`].
    pub fn stop(&self) -> Result<TableStatus, TurntableError> {
        self.ask(Question::Stop)
    }

    fn ask(&self, question: Question) -> Result<TableStatus, TurntableError> {
        let failed = |why: String| TurntableError::Owner {
            path: self.files.port.clone(),
            pid: self.pid,
            why,
        };
        let line = self.exchange(question).map_err(|error| {
            let why = with_causes(&error);
            failed(format!("did not answer: {why}; ask again, or end it"))
        })?;
        match serde_json::from_str(&line) {
            Ok(Answer::Status(status)) => Ok(status),
            Ok(Answer::Error(message)) => Err(failed(format!("says: {message}"))),
            Err(_) => Err(failed("gave no valid answer: end it".to_owned())),
        }
    }

    fn exchange(&self, question: Question) -> std::io::Result<String> {
        let mut stream = self.connect()?;
        stream.set_read_timeout(Some(ANSWER))?;
        stream.set_write_timeout(Some(ANSWER))?;
        let mut asked = serde_json::to_vec(&question)?;
        asked.push(b'\n');
        stream.write_all(&asked)?;
        let mut line = String::new();
        BufReader::new(stream.take(LONGEST)).read_line(&mut line)?;
        Ok(line)
    }

    /// An owner that is still opening its port has no socket yet.
    fn connect(&self) -> std::io::Result<UnixStream> {
        let until = Instant::now() + OPENING;
        let mut refused_until = None;
        loop {
            let error = match UnixStream::connect(&self.files.socket) {
                Ok(stream) => return Ok(stream),
                Err(error) => error,
            };
            let now = Instant::now();
            let until = match error.kind() {
                ErrorKind::PermissionDenied => *refused_until.get_or_insert(now + SHARING),
                _ => until,
            };
            if now >= until {
                return Err(error);
            }
            thread::sleep(PAUSE);
        }
    }
}
