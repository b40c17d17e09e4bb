//! The command line of the program.

mod arguments;
mod checking;
mod making;

use std::process::ExitCode;

use clap::{CommandFactory, Parser};
use relit_console::Console;

use arguments::{CommandLine, Verb};

/// Runs the program with the arguments of the process.
pub(crate) fn run() -> ExitCode {
    if let Some(code) = relit_console::written_manual(CommandLine::command()) {
        return code;
    }
    let line = CommandLine::parse();
    match (line.verb, line.mask) {
        (Some(Verb::Check { input, mask, json }), _) => {
            let console = Console::new(json);
            console.finish(checking::run(console, &input, mask.as_deref()))
        }
        (None, Some(arguments)) => making::run(&arguments),
        (None, None) => {
            // Nothing can be done if standard output is closed.
            let _ = CommandLine::command().print_help();
            ExitCode::from(2)
        }
    }
}
