//! The owner's server: answers requests at the socket.

use std::fs;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use relit_data::causes::with_causes;

use super::{Answer, Question};
use crate::lockfile::LockError;
use crate::turntable::error::TurntableError;
use crate::turntable::link::Link;

/// How long a client may take to send its request, or to read the answer.
const WAIT: Duration = Duration::from_millis(300);
/// Longest question, bytes.
const LONGEST: u64 = 64;
/// Pause after a failed accept.
const PAUSE: Duration = Duration::from_millis(50);

/// Answers requests of other processes until it is dropped.
pub(in crate::turntable) struct Server {
    socket: PathBuf,
    quit: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    /// Binds the socket. One that exists is left over from a killed process, since this process has the
    /// lock.
    pub(super) fn start(socket: &Path, link: Link) -> Result<Server, TurntableError> {
        match fs::remove_file(socket) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => UnixListener::bind(socket),
        }
        .map(|listener| {
            let quit = Arc::new(AtomicBool::new(false));
            let flag = Arc::clone(&quit);
            Server {
                socket: socket.to_owned(),
                quit,
                thread: Some(thread::spawn(move || serve(&listener, &link, &flag))),
            }
        })
        .map_err(|source| LockError::system(socket, "bound")(source).into())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.quit.store(true, Ordering::Release);
        // The thread waits until somebody connects.
        let woken = UnixStream::connect(&self.socket).is_ok();
        if let Some(thread) = self.thread.take().filter(|_| woken) {
            let _ = thread.join();
        }
        // The next owner removes what cannot be removed now.
        let _ = fs::remove_file(&self.socket);
    }
}

fn serve(listener: &UnixListener, link: &Link, quit: &AtomicBool) {
    for stream in listener.incoming() {
        if quit.load(Ordering::Acquire) {
            return;
        }
        match stream {
            // A bad request or a lost connection must not affect other clients.
            Ok(stream) => drop(answer(&stream, link)),
            Err(_) => thread::sleep(PAUSE),
        }
    }
}

fn answer(stream: &UnixStream, link: &Link) -> io::Result<()> {
    stream.set_read_timeout(Some(WAIT))?;
    stream.set_write_timeout(Some(WAIT))?;
    let mut line = String::new();
    BufReader::new(stream.take(LONGEST)).read_line(&mut line)?;
    let done = match serde_json::from_str(&line) {
        Ok(Question::Status) => link.status().map_err(|error| with_causes(&error)),
        Ok(Question::Stop) => link.stop().map_err(|error| with_causes(&error)),
        Err(_) => Err("the requests are \"status\" and \"stop\"".to_owned()),
    };
    let answer = match done {
        Ok(status) => Answer::Status(status),
        Err(message) => Answer::Error(message),
    };
    let mut text = serde_json::to_vec(&answer).map_err(io::Error::other)?;
    text.push(b'\n');
    let mut stream = stream;
    stream.write_all(&text)
}
