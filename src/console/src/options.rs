//! The options that every program of the toolkit has.

use clap::Args;

use super::Console;

/// How a program prints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Args)]
#[group(skip)]
pub struct ConsoleOptions {
    /// Print one JSON line per event on standard output.
    #[arg(long, global = true)]
    pub json: bool,
    /// With --json, also print progress.
    #[arg(long, global = true, requires = "json")]
    pub progress: bool,
}

impl ConsoleOptions {
    /// The console that prints so.
    pub fn console(self) -> Console {
        Console::new(self.json).with_progress(self.progress)
    }
}
