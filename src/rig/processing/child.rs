//! A program that works on a session: it gives way to everything else, can be held and ended, and is heard line by
//! line.

use std::io::{self, BufRead, BufReader, Read};
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process_group};

use super::heard::Heard;

/// Longest line that is read; what is longer is passed over.
const LONGEST_LINE: u64 = 1 << 20;
/// Lines that wait to be heard.
const LINES: usize = 64;
/// What is kept of standard error, bytes: its end.
const COMPLAINT: usize = 4096;
/// Time in which a program that was asked to end has to do so.
const GRACE: Duration = Duration::from_secs(3);

/// A program at work.
#[derive(Debug)]
pub(super) struct Worker {
    child: Child,
    lines: Receiver<Vec<u8>>,
    complaint: Arc<Mutex<Vec<u8>>>,
    is_held: bool,
    asked_to_end: Option<Instant>,
}

impl Worker {
    /// Starts a program in a process group of its own; at a niceness of 19 it gives way to all others.
    pub(super) fn start(mut command: Command, niceness: i32) -> io::Result<Self> {
        command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .process_group(0);
        let mut child = spawn_nice(&mut command, niceness)?;
        let (sender, lines) = sync_channel(LINES);
        if let Some(output) = child.stdout.take() {
            spawn_reader("relit-heard", move || {
                let mut reader = BufReader::new(output);
                while let Some(line) = next_line(&mut reader) {
                    if sender.send(line).is_err() {
                        return;
                    }
                }
            })?;
        }
        let complaint = Arc::new(Mutex::new(Vec::new()));
        if let Some(errors) = child.stderr.take() {
            let kept = Arc::clone(&complaint);
            spawn_reader("relit-complaint", move || keep_end(errors, &kept))?;
        }
        Ok(Self {
            child,
            lines,
            complaint,
            is_held: false,
            asked_to_end: None,
        })
    }

    /// Hands on what was said since.
    pub(super) fn hear(&self, heard: &mut Heard) {
        while let Ok(line) = self.lines.try_recv() {
            heard.line(&line);
        }
    }

    /// Holds the program, or lets it go on.
    pub(super) fn hold(&mut self, held: bool) {
        if held != self.is_held {
            self.is_held = held;
            self.signal(if held { Signal::STOP } else { Signal::CONT });
        }
    }

    /// Asks the program to end; one that does not is ended.
    pub(super) fn end(&mut self) {
        match self.asked_to_end {
            None => {
                self.asked_to_end = Some(Instant::now());
                self.signal(Signal::TERM);
                // A program that is held takes no signal but this.
                self.signal(Signal::CONT);
                self.is_held = false;
            }
            Some(asked) if asked.elapsed() > GRACE => self.signal(Signal::KILL),
            Some(_) => {}
        }
    }

    /// How the program ended, once it has, and everything that it said was heard.
    pub(super) fn ended(&mut self, heard: &mut Heard) -> io::Result<Option<ExitStatus>> {
        let Some(status) = self.child.try_wait()? else {
            return Ok(None);
        };
        let until = Instant::now() + GRACE;
        // The pipe closes with the program, unless a child of it goes on.
        while Instant::now() < until {
            match self.lines.try_recv() {
                Ok(line) => heard.line(&line),
                Err(TryRecvError::Disconnected) => break,
                Err(TryRecvError::Empty) => thread::park_timeout(Duration::from_millis(2)),
            }
        }
        Ok(Some(status))
    }

    /// The end of what the program wrote on standard error.
    pub(super) fn complaint(&self) -> String {
        let kept = self.complaint.lock();
        let kept = kept.unwrap_or_else(PoisonError::into_inner);
        String::from_utf8_lossy(&kept).into_owned()
    }

    fn signal(&self, signal: Signal) {
        let pid = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw);
        if let Some(pid) = pid {
            // A program that has ended by itself takes no signal any more.
            let _ = kill_process_group(pid, signal);
        }
    }
}

/// No program outlives the rig that started it.
impl Drop for Worker {
    fn drop(&mut self) {
        if matches!(self.child.try_wait(), Ok(None)) {
            self.signal(Signal::KILL);
            let _ = self.child.wait();
        }
    }
}

/// Starts a program that gives way to others. Linux keeps a priority for each thread, and a program inherits that of the
/// thread that starts it: one of its own, as whoever holds the program later must not wait.
fn spawn_nice(command: &mut Command, niceness: i32) -> io::Result<Child> {
    thread::scope(|scope| {
        let starter = scope.spawn(|| {
            // Where the system refuses, it runs as others do.
            let _ = rustix::process::setpriority_process(None, niceness);
            command.spawn()
        });
        let failed = |_| Err(io::Error::other("the thread that starts it failed"));
        starter.join().unwrap_or_else(failed)
    })
}

fn spawn_reader(name: &str, work: impl FnOnce() + Send + 'static) -> io::Result<()> {
    let thread = thread::Builder::new().name(name.to_owned());
    thread.spawn(work).map(drop)
}

/// The next line without its end; an overlong one is empty.
fn next_line(reader: &mut impl BufRead) -> Option<Vec<u8>> {
    let mut line = Vec::new();
    let read = reader.take(LONGEST_LINE).read_until(b'\n', &mut line);
    match read {
        Ok(0) | Err(_) => None,
        Ok(_) if line.ends_with(b"\n") => Some(line),
        // The last line may lack its end.
        Ok(read) if (read as u64) < LONGEST_LINE => Some(line),
        Ok(_) => {
            skip_line(reader);
            Some(Vec::new())
        }
    }
}

/// Passes over the rest of a line, however long.
fn skip_line(reader: &mut impl BufRead) {
    while let Ok(buffer) = reader.fill_buf() {
        let end = buffer.iter().position(|&byte| byte == b'\n');
        let used = end.map_or(buffer.len(), |at| at + 1);
        reader.consume(used);
        if end.is_some() || used == 0 {
            return;
        }
    }
}

fn keep_end(mut from: impl Read, kept: &Mutex<Vec<u8>>) {
    let mut piece = [0; 1024];
    while let Ok(read @ 1..) = from.read(&mut piece) {
        let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.extend(piece.iter().take(read));
        let excess = kept.len().saturating_sub(COMPLAINT);
        kept.drain(..excess);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_overlong_line_is_passed_over_and_the_next_one_is_whole() {
        let mut text = vec![b'x'; 3 << 20];
        text.extend_from_slice(b"\nlast");
        let mut reader = BufReader::new(&text[..]);
        assert_eq!(next_line(&mut reader), Some(Vec::new()));
        assert_eq!(next_line(&mut reader), Some(b"last".to_vec()));
        assert_eq!(next_line(&mut reader), None);
    }

    #[test]
    fn only_the_end_of_a_long_complaint_is_kept() {
        let kept = Mutex::new(Vec::new());
        let text = format!("{}end", "x".repeat(3 * COMPLAINT));
        keep_end(text.as_bytes(), &kept);
        let kept = kept.into_inner().unwrap();
        assert_eq!(kept.len(), COMPLAINT);
        assert!(kept.ends_with(b"end"));
    }
}
