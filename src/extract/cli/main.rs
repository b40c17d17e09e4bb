//! `relit-extract`: turns recordings into training shards of masked frames, joins, verifies and
//! sums them up, and describes them for those who publish them.

mod arguments;
mod carding;
mod extracting;
mod merging;
mod stats;
mod verifying;

use std::process::ExitCode;

use arguments::Command;
use relit_console::Console;

fn main() -> ExitCode {
    if let Some(code) = relit_console::written_manual(arguments::command()) {
        return code;
    }
    let arguments = arguments::parse();
    let console = Console::new(arguments.json).with_progress(arguments.progress);
    match arguments.command {
        Command::Extract {
            inputs,
            out,
            options,
        } => console.finish(extracting::run(console, &inputs, &out, &options)),
        Command::Card { out, facts } => console.finish(carding::run(console, &out, &facts)),
        Command::Merge { out } => console.finish(merging::run(console, &out)),
        Command::Stats { out, html } => console.finish(stats::run(console, &out, html.as_deref())),
        Command::Verify { out } => console.finish(verifying::run(console, &out)),
    }
}
