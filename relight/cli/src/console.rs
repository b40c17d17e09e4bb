//! Lines on the terminal, JSON lines, progress and exit codes. The one place that prints.
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "this is where printing belongs"
)]

use std::error::Error;
use std::io::{self, Write};
use std::process::ExitCode;
use std::sync::OnceLock;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use relit_data::causes::with_causes;
use serde_json::{Value, json};

/// What first kept a line from being printed, other than that nobody reads any more.
static LOST_LINE: OnceLock<io::Error> = OnceLock::new();

/// How a command that ran to its end came out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// All was done: exit code 0.
    Whole,
    /// Something was left out or lost, which was told: exit code 3.
    Incomplete,
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Whole => Self::SUCCESS,
            Outcome::Incomplete => Self::from(3),
        }
    }
}

/// What a command returns: an outcome, or the error that ends the program with exit code 1.
pub(crate) type CommandResult = Result<Outcome, Box<dyn Error>>;

/// Speaks for the program, to a person or, with `--json`, to a machine.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Console {
    json: bool,
}

impl Console {
    /// A console that prints JSON lines (`json`) or text on standard output.
    pub(crate) fn new(json: bool) -> Self {
        Self { json }
    }

    /// Whether lines are for a machine.
    pub(crate) fn is_json(self) -> bool {
        self.json
    }

    /// A result: `text` for a person, `event` as one JSON line for a machine.
    pub(crate) fn say(self, text: &str, event: &Value) {
        let json = event.to_string();
        // Where nobody reads any more, the work goes on.
        if let Err(fault) = writeln!(io::stdout(), "{}", if self.json { &json } else { text })
            && fault.kind() != io::ErrorKind::BrokenPipe
        {
            let _ = LOST_LINE.set(fault);
        }
    }

    /// Something that was left out, while the rest goes on.
    pub(crate) fn warn(self, text: &str, event: &Value) {
        if self.json {
            self.say("", event);
        }
        let _ = writeln!(io::stderr(), "warning: {text}");
    }

    /// The exit code of a command, after its error, if any, was told. Where lines could not be printed, the outcome
    /// is not whole.
    pub(crate) fn finish(self, result: CommandResult) -> ExitCode {
        match (result, LOST_LINE.get()) {
            (Ok(Outcome::Whole), Some(fault)) => {
                let _ = writeln!(
                    io::stderr(),
                    "error: standard output could not be written, lines are missing there: {fault}"
                );
                Outcome::Incomplete.into()
            }
            (Ok(outcome), _) => outcome.into(),
            (Err(error), _) => {
                let text = with_causes(error.as_ref());
                if self.json {
                    self.say("", &json!({ "event": "error", "message": text }));
                }
                let _ = writeln!(io::stderr(), "error: {text}");
                ExitCode::FAILURE
            }
        }
    }

    /// A progress bar over `length` steps; hidden with `--json` or where standard error is not a
    /// terminal.
    pub(crate) fn progress(self, length: u64, label: &'static str) -> ProgressBar {
        if self.json {
            return ProgressBar::hidden();
        }
        let bar = ProgressBar::new(length).with_message(label);
        let template = "{msg:.bold} {wide_bar} {pos}/{len} {per_sec} {eta}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        bar
    }
}
