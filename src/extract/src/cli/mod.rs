//! The command line of the program.

mod arguments;
mod extracting;
mod merging;
mod stats;
mod verifying;

use std::process::ExitCode;

use arguments::{CommandLine, Verb};
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser};

/// Runs the program with the arguments of the process.
pub(crate) fn run() -> ExitCode {
    if let Some(code) = relit_console::written_manual(CommandLine::command()) {
        return code;
    }
    let line = CommandLine::parse();
    let console = line.console.console();
    let wrong = |kind, text: &str| CommandLine::command().error(kind, text).exit();
    match (line.verb, line.extract) {
        (Some(_), Some(_)) => wrong(
            ErrorKind::ArgumentConflict,
            "an input and a command are given: write ./NAME for an input that is named like a command",
        ),
        (Some(Verb::Verify { out }), None) => console.finish(verifying::run(console, &out)),
        (Some(Verb::Merge { out }), None) => console.finish(merging::run(console, &out)),
        (Some(Verb::Stats { out }), None) => console.finish(stats::run(console, &out)),
        (None, Some(extract)) => match extract.options() {
            Ok(options) => {
                let (inputs, out) = (&extract.inputs, &extract.output);
                console.finish(extracting::run(console, inputs, out, &options))
            }
            Err(text) => wrong(ErrorKind::ValueValidation, &text),
        },
        (None, None) => wrong(
            ErrorKind::MissingRequiredArgument,
            "INPUT and --output are required",
        ),
    }
}
