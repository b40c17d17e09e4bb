//! `relit-extract`: turns recordings into training shards of masked frames, joins and verifies them.

mod arguments;
mod extracting;
mod merging;
mod verifying;

use std::process::ExitCode;

use arguments::Command;
use relit::console::Console;

fn main() -> ExitCode {
    let arguments = arguments::parse();
    let console = Console::new(arguments.json);
    match arguments.command {
        Command::Extract {
            inputs,
            out,
            options,
        } => console.finish(extracting::run(console, &inputs, &out, &options)),
        Command::Merge { out } => console.finish(merging::run(console, &out)),
        Command::Verify { out } => console.finish(verifying::run(console, &out)),
    }
}
