//! The command line, and what it asks for.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use relit_camera::CameraAddress;
use relit_camera::manual_controls::ManualValues;
use relit_capture::capture::{ModePreference, Settings, check_object};
use relit_capture::serve::ListenAddress;
use relit_console::ConsoleOptions;
use relit_turntable as turntable;

use super::turntable_arguments::{
    SIMULATE_EXAMPLES, SimulateArguments, TURNTABLE_EXAMPLES, TurntableArguments,
};

const EXAMPLES: &str = "\
Examples:
  relit-capture devices
      cameras with their modes and controls, and the turntable's port
  relit-capture record --object mug --camera v4l2:/dev/video0 --turntable serial:
      one turn of the object on the table, as a session folder in ./sessions
  relit-capture record --object mug --camera 'replay:fixtures/20261120T093015Z-cow?loop=1' --turntable sim:
      a rehearsal without hardware
  relit-capture serve --camera v4l2:/dev/video0 --turntable serial:
      the rig as a page for a browser
  relit-capture turntable status
      the state of the table at the only controller plugged in

Addresses: --camera v4l2:/dev/video0 | nokhwa:0 | replay:PATH, --turntable serial:/dev/ttyUSB0 | serial: | sim: | none.

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 finished, but something was left out or lost.";

/// Record turns of objects on a turntable as session folders.
#[derive(Parser)]
#[command(name = "relit-capture", version, after_help = EXAMPLES)]
pub(crate) struct CommandLine {
    #[command(subcommand)]
    pub(crate) verb: Verb,
    #[command(flatten)]
    pub(crate) console: ConsoleOptions,
}

#[derive(Subcommand)]
pub(crate) enum Verb {
    /// List cameras with their modes and controls, and the turntable's port.
    #[command(after_help = "Example:\n  relit-capture devices --json")]
    Devices,
    /// Capture one turn of the object on the table.
    #[command(
        after_help = "Example:\n  relit-capture record --object mug --turntable serial: --exposure 100"
    )]
    Record(Box<RecordArguments>),
    /// Measure the table's rotation direction, and note the camera's elevation, for later sessions.
    #[command(
        after_help = "Example:\n  relit-capture calibrate --turntable serial: --elevation 18"
    )]
    Calibrate(Box<CalibrateArguments>),
    /// Serve the rig: a page for a phone or a browser, and an interface for scripts.
    #[command(
        after_help = "Example:\n  relit-capture serve --turntable serial: --listen 0.0.0.0:8420"
    )]
    Serve(Box<ServeArguments>),
    /// Look at the turntable, or move it.
    #[command(after_help = TURNTABLE_EXAMPLES)]
    Turntable(TurntableArguments),
    /// Run a turntable without hardware: the firmware on a pseudoterminal.
    #[command(after_help = SIMULATE_EXAMPLES)]
    Simulate(SimulateArguments),
}

#[derive(Args)]
pub(crate) struct RecordArguments {
    /// The object's name: letters, digits, '-', '_' and '.'.
    #[arg(long, value_name = "NAME", value_parser = object)]
    pub(crate) object: String,
    #[command(flatten)]
    pub(crate) turn: TurnArguments,
}

#[derive(Args)]
pub(crate) struct CalibrateArguments {
    /// How steeply the camera looks down on the table, degrees [default: as noted before].
    #[arg(long, value_name = "DEGREES", value_parser = elevation)]
    pub(crate) elevation: Option<f64>,
    #[command(flatten)]
    pub(crate) turn: TurnArguments,
}

/// A turn that a person at the terminal lets begin.
#[derive(Args)]
pub(crate) struct TurnArguments {
    /// Do not ask before the table turns.
    #[arg(long)]
    pub(crate) yes: bool,
    #[command(flatten)]
    pub(crate) rig: RigArguments,
}

#[derive(Args)]
pub(crate) struct ServeArguments {
    /// Address and port; a port alone serves this machine only.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8420")]
    pub(crate) listen: ListenAddress,
    /// The token's file, for its owner and group only; made if missing [default: a new token each start, if other
    /// machines can reach the address].
    #[arg(long, value_name = "FILE")]
    pub(crate) token_file: Option<PathBuf>,
    /// A name of this machine, such as rig.local; may be repeated.
    #[arg(long = "name", value_name = "NAME")]
    pub(crate) names: Vec<String>,
    /// The folder for data sets [default: the one that holds --root].
    #[arg(long, value_name = "DIR")]
    pub(crate) datasets: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) rig: RigArguments,
}

#[derive(Args)]
pub(crate) struct RigArguments {
    /// The folder for session folders.
    #[arg(long, value_name = "DIR", default_value = "sessions")]
    root: PathBuf,
    /// The camera's address.
    #[arg(long, value_name = "ADDRESS", default_value = "v4l2:/dev/video0")]
    camera: CameraAddress,
    /// The turntable's address.
    #[arg(long, value_name = "ADDRESS", default_value = "serial:")]
    turntable: turntable::TurntableAddress,
    /// Speed of the turn, degrees a second.
    #[arg(long, value_name = "SPEED", default_value_t = 7.2, value_parser = speed)]
    degrees_per_second: f64,
    /// Pixel format, frame size and rate, or a part of that [default: compressed before raw, the largest frames, 30 a
    /// second].
    #[arg(long, value_name = "MJPG:1920x1080@30")]
    mode: Option<ModePreference>,
    /// Exposure to hold, in the camera's own units [default: as it is].
    #[arg(long, value_name = "VALUE")]
    exposure: Option<i64>,
    /// Gain to hold [default: as it is].
    #[arg(long, value_name = "VALUE")]
    gain: Option<i64>,
    /// White balance to hold, kelvin [default: as it is].
    #[arg(long, value_name = "KELVIN")]
    white_balance: Option<i64>,
    /// Focus to hold [default: as it is].
    #[arg(long, value_name = "VALUE")]
    focus: Option<i64>,
    /// Frames that may be missing or damaged in a take.
    #[arg(long, value_name = "N", default_value_t = 0)]
    max_dropped: u64,
    /// Retakes after a bad take; the bad ones are kept.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(0..=100))]
    retries: u32,
}

impl From<RigArguments> for Settings {
    fn from(line: RigArguments) -> Self {
        let mut settings = Self::new(line.root, line.camera, line.turntable);
        settings.mode = line.mode.unwrap_or_default();
        settings.wanted = ManualValues {
            exposure: line.exposure,
            gain: line.gain,
            white_balance: line.white_balance,
            focus: line.focus,
        };
        settings.degrees_per_second = line.degrees_per_second;
        settings.max_dropped = line.max_dropped;
        settings.retries = line.retries;
        settings.commit = option_env!("RELIT_COMMIT").unwrap_or_default().to_owned();
        settings
    }
}

fn figure(text: &str, low: f64, high: f64, what: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if (low..=high).contains(&value) => Ok(value),
        _ => Err(format!("give {what} from {low} to {high}")),
    }
}

fn object(text: &str) -> Result<String, String> {
    check_object(text).map(|()| text.to_owned())
}

fn speed(text: &str) -> Result<f64, String> {
    figure(text, 0.1, 360.0, "degrees a second")
}

fn elevation(text: &str) -> Result<f64, String> {
    figure(text, 0.0, 89.0, "degrees")
}
