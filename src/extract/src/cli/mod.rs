//! The command line of the program.

mod arguments;
mod converting;
mod extracting;
mod merging;
mod removing;
mod stats;
mod verifying;

use std::path::Path;
use std::process::ExitCode;

use arguments::{CommandLine, Verb};
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser};
use relit_extract::ExtractError;
use relit_extract::objects::is_url;

/// Refuses URLs where files are read one by one.
fn refuse_urls(paths: &[&Path]) -> Result<(), ExtractError> {
    match paths.iter().find(|path| is_url(path)) {
        None => Ok(()),
        Some(url) => Err(ExtractError::Refused(format!(
            "{} is a URL, and this command works on folders: copy the data set to the local disk first",
            url.display()
        ))),
    }
}

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
        (Some(Verb::Merge { out, output }), None) => match (out.as_slice(), output) {
            ([out], None) => console.finish(merging::merge_tasks(console, out)),
            ([_], Some(_)) | (_, None) => wrong(
                ErrorKind::ArgumentConflict,
                "give one data set that tasks have written, or two finished ones and more with --output",
            ),
            (several, Some(output)) => {
                console.finish(merging::merge_finished(console, several, &output))
            }
        },
        (
            Some(Verb::Convert {
                out,
                output,
                layout,
            }),
            None,
        ) => console.finish(converting::run(console, &out, &output, layout)),
        (Some(Verb::Remove { out, sessions }), None) => {
            console.finish(removing::run(console, &out, &sessions))
        }
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
