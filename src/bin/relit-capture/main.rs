//! `relit-capture`: drives the turntable, and records its turns.

mod arguments;
#[path = "../console/mod.rs"]
mod console;
mod simulate;
mod turntable;

use std::process::ExitCode;

use clap::Parser;

use arguments::{Arguments, Verb};
use console::Console;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let console = Console::new(arguments.json);
    match arguments.verb {
        Verb::Turntable(asked) => console.finish(turntable::run(console, &asked)),
        Verb::Simulate(asked) => console.finish(simulate::run(console, &asked)),
    }
}
