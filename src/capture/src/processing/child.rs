//! A program that works on a session: it can be paused and ended, and its output is read line by line.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process_group};

use super::events::ProgramEvent;

/// What is read of standard error, bytes: its end.
const COMPLAINT: u64 = 4096;
/// Time in which a program that was asked to end has to do so.
const GRACE: Duration = Duration::from_secs(3);

/// A program at work. It writes into files without names, so that it never waits for its reader.
#[derive(Debug)]
pub(super) struct Worker {
    child: Child,
    output: File,
    errors: File,
    /// How much of the output was read, bytes.
    read: u64,
    /// The line that has no end yet.
    line: Vec<u8>,
    is_held: bool,
    asked_to_end: Option<Instant>,
}

impl Worker {
    /// Starts a program in a process group of its own.
    pub(super) fn start(mut command: Command) -> io::Result<Self> {
        let (output, errors) = (tempfile::tempfile()?, tempfile::tempfile()?);
        command
            .stdin(Stdio::null())
            .stdout(output.try_clone()?)
            .stderr(errors.try_clone()?)
            .process_group(0);
        Ok(Self {
            child: command.spawn()?,
            output,
            errors,
            read: 0,
            line: Vec::new(),
            is_held: false,
            asked_to_end: None,
        })
    }

    /// Passes on what the program printed since.
    pub(super) fn read_events(&mut self, heard: &mut ProgramEvent) {
        let mut piece = [0; 4096];
        while let Ok(count @ 1..) = self.output.read_at(&mut piece, self.read) {
            self.read += count as u64;
            for &byte in piece.iter().take(count) {
                match byte {
                    b'\n' => heard.line(&std::mem::take(&mut self.line)),
                    _ => self.line.push(byte),
                }
            }
        }
    }

    /// Holds the program, or lets it go on.
    pub(super) fn set_paused(&mut self, held: bool) {
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

    /// How the program ended, once it has and all its output is read.
    pub(super) fn ended(&mut self, heard: &mut ProgramEvent) -> io::Result<Option<ExitStatus>> {
        let status = self.child.try_wait()?;
        if status.is_some() {
            self.read_events(heard);
        }
        Ok(status)
    }

    /// The end of what the program wrote on standard error.
    pub(super) fn error_output(&self) -> String {
        let written = self.errors.metadata().map_or(0, |data| data.len());
        let mut end = vec![0; written.min(COMPLAINT) as usize];
        let from = written.saturating_sub(COMPLAINT);
        match self.errors.read_exact_at(&mut end, from) {
            Ok(()) => String::from_utf8_lossy(&end).into_owned(),
            Err(error) => format!("the program's output could not be read: {error}"),
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_end_of_a_long_complaint_is_kept() {
        let mut command = Command::new("sh");
        command.args([
            "-c",
            "head -c 20000 /dev/zero | tr '\\0' x >&2; printf end >&2",
        ]);
        let mut worker = Worker::start(command).unwrap();
        worker.child.wait().unwrap();
        let error_output = worker.error_output();
        assert_eq!(error_output.len() as u64, COMPLAINT);
        assert!(error_output.ends_with("xend"));
    }
}
