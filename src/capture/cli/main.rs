//! `relit-capture`: lists cameras and turntables, records a turn, serves the rig, and looks after the
//! turntable.

mod arguments;
mod devices;
mod environment;
mod recording;
mod serving;
mod simulate;
mod turntable;
mod turntable_arguments;

use std::process::ExitCode;

use arguments::Command;
use relit_console::Console;

fn main() -> ExitCode {
    if let Some(code) = relit_console::written_manual(arguments::command()) {
        return code;
    }
    let arguments = arguments::parse();
    let console = Console::new(arguments.json);
    match arguments.command {
        Command::Devices => devices::run(console),
        Command::Record(record) => console.finish(recording::run(console, *record)),
        Command::Serve(serve) => console.finish(serving::run(console, *serve)),
        Command::Turntable(asked) => console.finish(turntable::run(console, &asked)),
        Command::Simulate(asked) => console.finish(simulate::run(console, &asked)),
    }
}
