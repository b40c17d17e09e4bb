//! The command line of the program.

mod arguments;
mod calibrating;
mod devices;
mod environment;
mod recording;
mod serving;
mod simulate;
mod turntable;
mod turntable_arguments;

use std::process::ExitCode;

use arguments::{CommandLine, Verb};
use clap::{CommandFactory, Parser};

/// Runs the program with the arguments of the process.
pub(crate) fn run() -> ExitCode {
    if let Some(code) = relit_console::written_manual(CommandLine::command()) {
        return code;
    }
    let line = CommandLine::parse();
    let console = line.console.console();
    match line.verb {
        Verb::Devices => console.finish(devices::run(console)),
        Verb::Record(record) => console.finish(recording::run(console, *record)),
        Verb::Calibrate(asked) => console.finish(calibrating::run(console, *asked)),
        Verb::Serve(serve) => console.finish(serving::run(console, *serve)),
        Verb::Turntable(asked) => console.finish(turntable::run(console, &asked)),
        Verb::Simulate(asked) => console.finish(simulate::run(console, &asked)),
    }
}
