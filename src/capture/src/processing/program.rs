//! A program that works on a session: it can be held and ended, and what it prints is read line by line.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};

use relit_console::Event;
use rustix::process::{Pid, Signal, kill_process_group};

/// What is read of standard error, bytes: its end.
const COMPLAINT: u64 = 4096;

/// A program at work. It writes into files without names, so that it never waits for its reader.
#[derive(Debug)]
pub(super) struct Program {
    child: Child,
    output: File,
    errors: File,
    /// How much of the output was read, bytes.
    read: u64,
    /// The line that has no end yet.
    line: Vec<u8>,
    is_held: bool,
    said: Said,
}

/// What a program said, one JSON object a line. What it made is read from its files.
#[derive(Debug, Default)]
struct Said {
    progress: Option<(u64, u64)>,
    /// Its error, or why it left the session out.
    error: Option<String>,
}

impl Program {
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
            said: Said::default(),
        })
    }

    /// The newest word on the progress, once.
    pub(super) fn take_progress(&mut self) -> Option<(u64, u64)> {
        self.read_output();
        self.said.progress.take()
    }

    /// Holds the program, or lets it go on.
    pub(super) fn set_held(&mut self, held: bool) {
        if held != self.is_held {
            self.is_held = held;
            self.signal(if held { Signal::STOP } else { Signal::CONT });
        }
    }

    /// Once the program has ended: `Ok` if it made its files, with or without losses, or else what went wrong, for a
    /// person.
    pub(super) fn ended(&mut self) -> Option<Result<(), String>> {
        let exit_code = match self.child.try_wait() {
            Ok(None) => return None,
            Ok(Some(status)) => status.code(),
            Err(_) => None,
        };
        self.read_output();
        let is_success = matches!(exit_code, Some(0 | 3)) && self.said.error.is_none();
        Some(if is_success {
            Ok(())
        } else {
            Err(self.said.failure(exit_code, &self.error_output()))
        })
    }

    fn read_output(&mut self) {
        let mut piece = [0; 4096];
        while let Ok(count @ 1..) = self.output.read_at(&mut piece, self.read) {
            self.read += count as u64;
            for &byte in piece.iter().take(count) {
                match byte {
                    b'\n' => self.said.line(&std::mem::take(&mut self.line)),
                    _ => self.line.push(byte),
                }
            }
        }
    }

    /// The end of what the program wrote on standard error.
    fn error_output(&self) -> String {
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

/// A program that nobody waits for any more is ended at once: what it leaves, its next run clears away.
impl Drop for Program {
    fn drop(&mut self) {
        if matches!(self.child.try_wait(), Ok(None)) {
            self.signal(Signal::KILL);
            let _ = self.child.wait();
        }
    }
}

impl Said {
    /// Takes in a line. What cannot be understood is passed over: newer programs say more.
    fn line(&mut self, line: &[u8]) {
        match serde_json::from_slice(line) {
            Ok(Event::Progress { done, of, .. }) => self.progress = Some((done, of)),
            Ok(Event::Error { message, .. } | Event::LeftOut { message, .. }) => {
                self.error = Some(message);
            }
            _ => {}
        }
    }

    /// What went wrong; `error_output` is what the program wrote on standard error.
    fn failure(&self, exit_code: Option<i32>, error_output: &str) -> String {
        let last = || {
            let mut lines = error_output.lines().map(str::trim);
            let last = lines.rfind(|line| !line.is_empty())?;
            Some(last.strip_prefix("error: ").unwrap_or(last).to_owned())
        };
        self.error
            .clone()
            .or_else(last)
            .unwrap_or_else(|| match exit_code {
                Some(code) => format!("the program ended with exit code {code}, without a message"),
                None => "the program was ended by a signal: check the machine's memory".to_owned(),
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ended(script: &str) -> (Program, Result<(), String>) {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        let mut program = Program::start(command).unwrap();
        program.child.wait().unwrap();
        let end = program.ended().unwrap();
        (program, end)
    }

    #[test]
    fn only_the_end_of_a_long_complaint_is_kept() {
        let (program, end) =
            ended("head -c 20000 /dev/zero | tr '\\0' x >&2; printf end >&2; exit 1");
        assert_eq!(program.error_output().len() as u64, COMPLAINT);
        assert!(end.unwrap_err().ends_with("xend"));
    }

    #[test]
    fn a_program_that_says_nothing_is_reported_by_what_ended_it() {
        assert!(ended("exit 7").1.unwrap_err().contains('7'));
        let signal = ended("kill -9 $$").1.unwrap_err();
        assert!(!signal.trim().is_empty() && signal != ended("exit 0x").1.unwrap_err());
        assert_eq!(ended("echo 'error: a' >&2; exit 1").1.unwrap_err(), "a");
    }

    #[test]
    fn a_session_that_was_left_out_has_failed() {
        assert!(ended("echo no JSON").1.is_ok() && ended("exit 3").1.is_ok());
        let left_out = r#"{"event":"left_out","input":"a","message":"the frames cover 20"}"#;
        let script = format!("echo '{left_out}'; echo 'warning: x' >&2; exit 3");
        assert_eq!(ended(&script).1.unwrap_err(), "the frames cover 20");
    }
}
