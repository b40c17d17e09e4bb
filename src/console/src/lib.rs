//! The output of the programs, for a person or a machine: lines on the terminal, JSON lines, progress,
//! exit codes. Nothing else in the workspace prints.
//!
//! One rule for all programs:
//!
//! | | without `--json` | with `--json` |
//! | --- | --- | --- |
//! | results | text on standard output | JSON lines on standard output |
//! | what is being done | text on standard error | JSON lines on standard output |
//! | warnings and errors | text on standard error | JSON lines on standard output, and the same text on standard error |
//! | progress | a bar on standard error, where that is a terminal | JSON lines, where the program was asked for them |
//!
//! So standard output alone tells a machine everything, and standard error alone, which a cluster keeps as
//! the log of a job, tells a person what went wrong.
//!
//! The exit code is an [`Outcome`], 1 for an error, or 2 for wrong arguments (which `clap` reports).
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "printing is the purpose of this crate"
)]

use std::error::Error;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;
use std::sync::OnceLock;

use relit_data::causes::with_causes;
use serde::Serialize;
use serde_json::Value;

mod duration;
mod event;
mod manual;
mod options;
mod progress;
mod totals;

pub use duration::format_duration;
pub use event::{Check, Done, Event};
pub use manual::written_manual;
pub use options::ConsoleOptions;
pub use progress::ProgressBar;
pub use totals::RunTotals;

/// The outcome of a command that ran to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Everything was done: exit code 0.
    Success,
    /// Finished, but nothing came out, or a check failed: exit code 1.
    Failure,
    /// Finished, but something was left out or lost: exit code 3.
    Partial,
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Success => Self::SUCCESS,
            Outcome::Failure => Self::from(1),
            Outcome::Partial => Self::from(3),
        }
    }
}

/// The output of one program, for a person or, with `--json`, for a machine.
#[derive(Debug, Clone, Copy)]
pub struct Console {
    json: bool,
    progress: bool,
}

impl Console {
    /// A console that prints JSON lines (`json`) or text on standard output.
    pub fn new(json: bool) -> Self {
        Self {
            json,
            progress: false,
        }
    }

    /// The same, which with `wanted` tells a machine also the progress, twice a second at most:
    /// `{"event": "progress", "what": ..., "done": ..., "of": ...}`, where 0 of 0 steps are not counted yet.
    #[must_use]
    pub fn with_progress(self, wanted: bool) -> Self {
        Self {
            progress: wanted,
            ..self
        }
    }

    /// Whether a machine reads the lines.
    pub fn is_json(self) -> bool {
        self.json
    }

    /// A result: `text` for a person, `event`, such as an [`Event`], as one JSON line for a machine.
    pub fn print(self, text: &str, event: &impl Serialize) {
        if self.json {
            print_line(&json_of(event));
        } else {
            print_line(text);
        }
    }

    /// Text for a person; nothing for a machine.
    pub fn print_text(self, text: &str) {
        if !self.json {
            print_line(text);
        }
    }

    /// What is being done: on standard error for a person, as a JSON line for a machine.
    pub fn print_phase(self, text: &str, event: &impl Serialize) {
        if self.json {
            print_line(&json_of(event));
        } else {
            print_error_line(text);
        }
    }

    /// A question to a person at the terminal, on standard error.
    pub fn ask(self, question: &str) {
        let _ = write!(io::stderr(), "{question}");
        let _ = io::stderr().flush();
    }

    /// Largest number of lines of a long list: `for_people`, or all for a machine.
    pub fn max_lines(self, for_people: usize) -> usize {
        if self.json { usize::MAX } else { for_people }
    }

    /// A warning.
    pub fn warn(self, text: &str) {
        let event = Event::Warning {
            session: None,
            message: text.to_owned(),
        };
        self.warn_with(text, &event);
    }

    /// A warning about a session.
    pub fn warn_for(self, session: &str, text: &str) {
        let event = Event::Warning {
            session: Some(session.to_owned()),
            message: text.to_owned(),
        };
        self.warn_with(&format!("{session}: {text}"), &event);
    }

    /// A warning that is its own event for a machine.
    pub fn warn_with(self, text: &str, event: &impl Serialize) {
        if self.json {
            print_line(&json_of(event));
        }
        print_error_line(&format!("warning: {text}"));
    }

    /// An error, with its causes, as one sentence.
    pub fn error(self, error: &(dyn Error + 'static)) {
        self.print_error(&with_causes(error), None, None);
    }

    /// An error that concerns one of several inputs, and its session, if it is one.
    pub fn error_for(self, input: &Path, session: Option<&str>, error: &(dyn Error + 'static)) {
        self.print_error(&with_causes(error), Some(input), session);
    }

    fn print_error(self, text: &str, input: Option<&Path>, session: Option<&str>) {
        if self.json {
            let event = Event::Error {
                session: session.map(str::to_owned),
                message: text.to_owned(),
                input: input.map(|input| input.to_string_lossy().into_owned()),
            };
            print_line(&json_of(&event));
        }
        match input {
            Some(input) if !text.contains(&*input.to_string_lossy()) => {
                print_error_line(&format!("error: {}: {text}", input.display()));
            }
            _ => print_error_line(&format!("error: {text}")),
        }
    }

    /// Prints the command's error, if there is one, and returns the exit code. Where lines could not be printed, the
    /// outcome is not whole.
    pub fn finish<E: Into<Box<dyn Error>>>(self, result: Result<Outcome, E>) -> ExitCode {
        match (result, lost_line()) {
            (Ok(Outcome::Success), Some(fault)) => {
                print_error_line(&format!(
                    "error: standard output could not be written, lines are missing there: {fault}"
                ));
                Outcome::Partial.into()
            }
            (Ok(outcome), _) => outcome.into(),
            (Err(error), _) => {
                self.error(error.into().as_ref());
                ExitCode::FAILURE
            }
        }
    }

    /// A progress bar of `length` steps; hidden if standard error is not a terminal. With `--json` lines for
    /// the machine, or nothing where it did not [ask for them](Self::with_progress).
    pub fn progress(self, length: u64, label: &str) -> ProgressBar {
        self.progress_in(None, length, label)
    }

    /// The same for the work on a session.
    pub fn progress_in(self, session: Option<&str>, length: u64, label: &str) -> ProgressBar {
        match (self.json, self.progress) {
            (true, true) => ProgressBar::lines(session, length, label),
            (true, false) => ProgressBar::hidden(),
            (false, _) => ProgressBar::visible(length, label),
        }
    }
}

/// An event as a line: its fields in the order of their names.
pub(crate) fn json_of(event: &impl Serialize) -> String {
    // Plain values of text and numbers: nothing in them that JSON lacks.
    let value: Value = serde_json::to_value(event).unwrap_or_default();
    value.to_string()
}

/// What first kept a line from being printed, other than that nobody reads any more.
static LOST_LINE: OnceLock<io::Error> = OnceLock::new();

/// What kept a line from being printed, if anything did.
fn lost_line() -> Option<&'static io::Error> {
    LOST_LINE.get()
}

/// Prints a line. If the output is closed, the work continues without it.
pub(crate) fn print_line(text: &str) {
    if let Err(fault) = writeln!(io::stdout(), "{text}")
        && fault.kind() != io::ErrorKind::BrokenPipe
    {
        let _ = LOST_LINE.set(fault);
    }
}

fn print_error_line(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}
