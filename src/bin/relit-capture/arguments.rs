//! The command line, and what it asks for.

use clap::{Args, Parser, Subcommand};
use relit::turntable::Address;

const EXAMPLES: &str = "\
Examples:
  relit-capture turntable status
      what the table at the only controller plugged in is doing
  relit-capture turntable --turntable serial:/dev/ttyUSB0 home
      find the index, or make zero of where the table stands
  relit-capture turntable jog -90
      turn by 90 degrees, back
  relit-capture turntable stop
      stop it, also from beside a capture that runs

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 finished, but something was left out or lost.";

/// Drive the turntable and record its turns.
#[derive(Parser)]
#[command(name = "relit-capture", version, after_help = EXAMPLES)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) verb: Verb,
    /// Print JSON lines, for machines.
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

#[derive(Subcommand)]
pub(crate) enum Verb {
    /// Look at the turntable, or move it.
    #[command(after_help = EXAMPLES)]
    Turntable(TurntableArguments),
}

#[derive(Args)]
pub(crate) struct TurntableArguments {
    /// The table: serial:/dev/ttyUSB0, serial: (the only controller plugged in) or sim:.
    #[arg(long, value_name = "ADDRESS", default_value = "serial:", global = true)]
    pub(crate) turntable: Address,
    #[command(subcommand)]
    pub(crate) action: Action,
}

#[derive(Subcommand)]
pub(crate) enum Action {
    /// Tell what the table is doing.
    Status,
    /// Find the index; without an index sensor, count from where the table stands.
    Home,
    /// Turn by so many degrees, negative for back, and wait until it is done.
    Jog {
        /// Degrees from here.
        #[arg(value_name = "DEGREES", allow_negative_numbers = true)]
        degrees: f64,
        /// Degrees a second; by default as fast as is gentle.
        #[arg(long, value_name = "DEGREES_PER_SECOND")]
        speed: Option<f64>,
    },
    /// Slow the table down to a stop and drop what it had to do.
    Stop,
    /// Release the lock after an alarm.
    Unlock,
}
