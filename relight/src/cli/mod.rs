//! The command line of `relight`.

mod commands;
mod console;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use commands::render;
use console::Console;

/// Single-view relighting: light, rendering, data with truth, and the measures of the results.
#[derive(Parser)]
#[command(
    name = "relight",
    version,
    after_help = "Exit codes: 0 done, 1 failed, 2 wrong usage, 3 finished, but something was left out or lost."
)]
struct CommandLine {
    #[command(subcommand)]
    verb: Verb,
    /// Print one JSON line an event on standard output.
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Subcommand)]
enum Verb {
    /// Light an object that is given by its maps: an image, a turn, or a sweep of materials.
    #[command(after_help = render::EXAMPLES)]
    Render(render::Arguments),
}

/// Runs the verb that the command line names; its exit code.
pub(crate) fn run() -> ExitCode {
    let line = CommandLine::parse();
    let console = Console::new(line.json);
    console.finish(match line.verb {
        Verb::Render(arguments) => render::run(&arguments, console),
    })
}
