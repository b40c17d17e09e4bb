//! `relight`: one verb a file under `cli/commands`; the library does the work.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run()
}
