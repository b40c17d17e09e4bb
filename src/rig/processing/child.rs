//! A program that works on a session: it can be held and ended, and is heard line by line.

use std::io::{self, BufRead, BufReader, Read};
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process_group};

use super::heard::Heard;

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
    /// Starts a program in a process group of its own.
    pub(super) fn start(mut command: Command) -> io::Result<Self> {
        command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .process_group(0);
        let mut child = command.spawn()?;
        let (sender, lines) = sync_channel(LINES);
        if let Some(output) = child.stdout.take() {
            spawn_reader("relit-heard", move || {
                let mut lines = BufReader::new(output).split(b'\n').map_while(Result::ok);
                // Nobody listens any more once this fails.
                let _ = lines.try_for_each(|line| sender.send(line));
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

fn spawn_reader(name: &str, work: impl FnOnce() + Send + 'static) -> io::Result<()> {
    let thread = thread::Builder::new().name(name.to_owned());
    thread.spawn(work).map(drop)
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
    fn only_the_end_of_a_long_complaint_is_kept() {
        let kept = Mutex::new(Vec::new());
        let text = format!("{}end", "x".repeat(3 * COMPLAINT));
        keep_end(text.as_bytes(), &kept);
        let kept = kept.into_inner().unwrap();
        assert_eq!(kept.len(), COMPLAINT);
        assert!(kept.ends_with(b"end"));
    }
}
