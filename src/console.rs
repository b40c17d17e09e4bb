//! The edge between the programs and a person or a machine: lines on the terminal, JSON lines,
//! progress, exit codes. The one place that prints.
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "this is where printing belongs"
)]

use std::error::Error;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use relit_data::causes::with_causes;
use serde_json::Value;

/// How a command that ran to its end came out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// All was done: exit code 0.
    Whole,
    /// Finished, and what was asked to be checked is wrong: exit code 1.
    Wrong,
    /// Finished, but something was left out or lost: exit code 3.
    Lossy,
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Whole => Self::SUCCESS,
            Outcome::Wrong => Self::from(1),
            Outcome::Lossy => Self::from(3),
        }
    }
}

/// Speaks for one program, to a person or, with `--json`, to a machine.
#[derive(Debug, Clone, Copy)]
pub struct Console {
    json: bool,
}

impl Console {
    /// A console that prints JSON lines (`json`) or text on standard output.
    pub fn new(json: bool) -> Self {
        Self { json }
    }

    /// A result: `text` for a person, `event` as one JSON line for a machine.
    pub fn say(self, text: &str, event: &Value) {
        if self.json {
            print_line(&event.to_string());
        } else {
            print_line(text);
        }
    }

    /// What is being done now: standard error for a person, a JSON line for a machine.
    pub fn say_phase(self, text: &str, event: &Value) {
        if self.json {
            print_line(&event.to_string());
        } else {
            print_error_line(text);
        }
    }

    /// A question for a person at the terminal, on standard error.
    pub fn ask(self, question: &str) {
        let _ = write!(io::stderr(), "{question}");
        let _ = io::stderr().flush();
    }

    /// How many lines of a long list to print: `for_people`, or all for a machine.
    pub fn most_lines(self, for_people: usize) -> usize {
        if self.json { usize::MAX } else { for_people }
    }

    /// A warning: standard error for a person, a JSON line for a machine.
    pub fn warn(self, text: &str) {
        if self.json {
            print_line(&serde_json::json!({ "event": "warning", "message": text }).to_string());
        } else {
            print_error_line(&format!("warning: {text}"));
        }
    }

    /// An error, with its causes, as one sentence.
    pub fn error(self, error: &(dyn Error + 'static)) {
        self.tell(&with_causes(error), None);
    }

    /// An error with one of several inputs.
    pub fn error_in(self, input: &Path, error: &(dyn Error + 'static)) {
        self.tell(&with_causes(error), Some(input));
    }

    fn tell(self, text: &str, input: Option<&Path>) {
        if self.json {
            let event = serde_json::json!({ "event": "error", "message": text, "input": input.map(Path::to_string_lossy) });
            print_line(&event.to_string());
        }
        match input {
            Some(input) if !text.contains(&*input.to_string_lossy()) => {
                print_error_line(&format!("error: {}: {text}", input.display()));
            }
            _ => print_error_line(&format!("error: {text}")),
        }
    }

    /// The exit code of a command, after its error, if any, was told.
    pub fn finish<E: Error + 'static>(self, result: Result<Outcome, E>) -> ExitCode {
        match result {
            Ok(outcome) => outcome.into(),
            Err(error) => {
                self.error(&error);
                ExitCode::FAILURE
            }
        }
    }

    /// A progress bar over `length` steps; hidden with `--json` or where standard error is not a
    /// terminal.
    pub fn progress(self, length: u64, label: &str) -> ProgressBar {
        if self.json {
            return ProgressBar::hidden();
        }
        let bar = ProgressBar::new(length).with_message(label.to_owned());
        let template = "{msg:.bold} {wide_bar} {pos}/{len} {per_sec} {eta}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        bar
    }
}

/// Where nobody reads any more, there is nobody to tell, and the work goes on.
fn print_line(text: &str) {
    let _ = writeln!(io::stdout(), "{text}");
}

fn print_error_line(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}
