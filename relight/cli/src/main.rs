//! `relight`: one verb a file under `commands`; the libraries do the work.

mod command_line;
mod commands;
mod folder;
mod inputs;
mod library;
mod lighting;
mod photos;
mod shipped;
mod values;

use std::process::ExitCode;

fn main() -> ExitCode {
    command_line::run()
}
