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
use relit_console::Console;

/// Runs the program with the arguments of the process.
pub(crate) fn run() -> ExitCode {
    if let Some(code) = relit_console::written_manual(CommandLine::command()) {
        return code;
    }
    let line = CommandLine::parse();
    let wrong = |kind, text: &str| CommandLine::command().error(kind, text).exit();
    match (line.verb, line.extract) {
        (
            Some(Verb::Verify {
                out,
                json,
                progress,
            }),
            _,
        ) => {
            let console = Console::new(json).with_progress(progress);
            console.finish(verifying::run(console, &out))
        }
        (Some(Verb::Merge { out, json }), _) => {
            let console = Console::new(json);
            console.finish(merging::run(console, &out))
        }
        (Some(Verb::Stats { out, json }), _) => {
            let console = Console::new(json);
            console.finish(stats::run(console, &out))
        }
        (None, Some(extract)) => {
            let console = Console::new(extract.json).with_progress(extract.progress);
            match extract.options() {
                Ok(options) => {
                    let (inputs, out) = (&extract.inputs, &extract.out);
                    console.finish(extracting::run(console, inputs, out, &options))
                }
                Err(text) => wrong(ErrorKind::ValueValidation, &text),
            }
        }
        (None, None) => wrong(
            ErrorKind::MissingRequiredArgument,
            "INPUT and --out are required",
        ),
    }
}
