//! The command line of the verbs that need no camera: `turntable` and `simulate`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use relit_turntable::TurntableAddress;
use relit_turntable::simulator::TableFaults;

pub(crate) const TURNTABLE_EXAMPLES: &str = "\
Examples:
  relit-capture turntable status
      the state of the table at the only controller plugged in
  relit-capture turntable --turntable serial:/dev/ttyUSB0 home
      find the index, or take the present angle as zero
  relit-capture turntable jog -90
      turn by 90 degrees, back
  relit-capture turntable jog --home 45
      find zero, then turn to 45 degrees
  relit-capture turntable stop
      stop it, and end a capture that uses it

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 finished, but something was left out or lost.";

pub(crate) const SIMULATE_EXAMPLES: &str = "\
Examples:
  relit-capture simulate --link /tmp/table
      then, in another terminal: relit-capture turntable --turntable serial:/tmp/table status
  relit-capture simulate --fault reset@12.5s,stall@20s
      a controller that restarts, and then hangs

Faults: reset@TIME restarts the controller, stall@TIME hangs it, estop@TIME presses the emergency stop.";

#[derive(Args)]
pub(crate) struct TurntableArguments {
    /// The table: serial:/dev/ttyUSB0, or serial: (the only controller plugged in).
    #[arg(long, value_name = "ADDRESS", default_value = "serial:", global = true)]
    pub(crate) turntable: TurntableAddress,
    #[command(subcommand)]
    pub(crate) action: Action,
}

#[derive(Subcommand)]
pub(crate) enum Action {
    /// Show what the table is doing.
    Status,
    /// Find the index; without an index sensor, count from where the table stands.
    Home,
    /// Turn the table by an angle, negative for back, and wait for the end.
    Jog {
        /// Degrees from here.
        #[arg(value_name = "DEGREES", allow_negative_numbers = true, value_parser = degrees)]
        degrees: f64,
        /// Speed, degrees a second [default: 30, or the highest of a slower table].
        #[arg(long, value_name = "DEGREES_PER_SECOND", value_parser = degrees)]
        speed: Option<f64>,
        /// Home the table first; needed if opening the port resets the controller and `$22=1`.
        #[arg(long)]
        home: bool,
    },
    /// Stop the table smoothly, drop its queue, and end the relit program that uses it.
    Stop,
    /// Release the lock after an alarm.
    Unlock,
}

#[derive(Args)]
pub(crate) struct SimulateArguments {
    /// Link PATH to the simulated port.
    #[arg(long, value_name = "PATH")]
    pub(crate) link: Option<PathBuf>,
    /// Speed, as a multiple of real time.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = speed)]
    pub(crate) speed: f64,
    /// Faults, such as reset@12.5s.
    #[arg(long, value_name = "FAULTS")]
    pub(crate) fault: Option<TableFaults>,
}

fn degrees(text: &str) -> Result<f64, String> {
    let number = text
        .parse()
        .ok()
        .filter(|degrees: &f64| degrees.is_finite());
    number.ok_or_else(|| "give degrees as a number, such as 90 or -12.5".to_owned())
}

fn speed(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|factor: &f64| factor.is_finite() && (0.01..=100.0).contains(factor))
        .ok_or_else(|| "a speed is a number from 0.01 to 100".to_owned())
}
