//! The command line of the program.

mod arguments;
mod checking;
mod making;

use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser};

use arguments::{CommandLine, Verb};

/// Runs the program with the arguments of the process.
pub(crate) fn run() -> ExitCode {
    if let Some(code) = relit_console::written_manual(CommandLine::command()) {
        return code;
    }
    let line = CommandLine::parse();
    let console = line.console.console();
    match (line.verb, line.mask) {
        (Some(_), Some(_)) => CommandLine::command()
            .error(
                ErrorKind::ArgumentConflict,
                "an input and a command are given: write ./check for an input of that name",
            )
            .exit(),
        (Some(Verb::Check { input, mask }), None) => {
            console.finish(checking::run(console, &input, mask.as_deref()))
        }
        (None, Some(arguments)) => making::run(console, &arguments),
        (None, None) => {
            // Nothing can be done if standard output is closed.
            let _ = CommandLine::command().print_help();
            ExitCode::from(2)
        }
    }
}
