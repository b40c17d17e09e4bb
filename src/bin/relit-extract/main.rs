//! `relit-extract`: turns recordings into training shards of masked frames, and verifies them.

mod arguments;
mod extracting;
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
        Command::Verify { out } => console.finish(verifying::run(console, &out)),
    }
}
