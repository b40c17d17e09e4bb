//! The command line, and what it asks for.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::{Args, CommandFactory, Parser, Subcommand};
use relit_rig::camera::hold::ManualValues;
use relit_rig::camera::{CameraAddress, Fourcc};
use relit_rig::capture::{ModePreference, Settings};
use relit_rig::serve::{ListenAddress, Token};
use relit_rig::turntable;

use crate::turntable_arguments::{
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
      what the table at the only controller plugged in is doing

Addresses: --camera v4l2:/dev/video0 | nokhwa:0 | replay:PATH, --turntable serial:/dev/ttyUSB0 | serial: | sim: | none.

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 finished, but something was left out or lost.";

/// What the command line asks for.
pub(crate) struct Arguments {
    pub(crate) json: bool,
    pub(crate) command: Command,
}

/// What the program does.
pub(crate) enum Command {
    Devices,
    Record(Box<Record>),
    Serve(Box<Serve>),
    Turntable(TurntableArguments),
    Simulate(SimulateArguments),
}

/// One capture.
pub(crate) struct Record {
    pub(crate) settings: Settings,
    pub(crate) object: String,
    pub(crate) meter: bool,
    pub(crate) yes: bool,
}

/// The daemon.
pub(crate) struct Serve {
    pub(crate) settings: Settings,
    pub(crate) address: SocketAddr,
    pub(crate) token: Option<Token>,
    pub(crate) token_file: Option<PathBuf>,
    pub(crate) names: Vec<String>,
    pub(crate) datasets: Option<PathBuf>,
}

/// Record turns of objects on a turntable as session folders.
#[derive(Parser)]
#[command(name = "relit-capture", version, after_help = EXAMPLES)]
struct CommandLine {
    #[command(subcommand)]
    verb: Verb,
    /// Print JSON lines on standard output, for machines.
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Subcommand)]
enum Verb {
    /// List cameras with their modes and controls, and the turntable's port.
    #[command(after_help = "Example:\n  relit-capture devices --json")]
    Devices,
    /// Capture one turn of the object on the table.
    #[command(
        after_help = "Example:\n  relit-capture record --object mug --turntable serial: --meter"
    )]
    Record(RecordArguments),
    /// Serve the rig: a page for a phone or a browser, and an interface for scripts.
    #[command(
        after_help = "Example:\n  relit-capture serve --turntable serial: --listen 0.0.0.0:8420"
    )]
    Serve(ServeArguments),
    /// Look at the turntable, or move it.
    #[command(after_help = TURNTABLE_EXAMPLES)]
    Turntable(TurntableArguments),
    /// Run a turntable without hardware: the firmware on a pseudoterminal.
    #[command(after_help = SIMULATE_EXAMPLES)]
    Simulate(SimulateArguments),
}

#[derive(Args)]
struct RecordArguments {
    /// The object's name, as it goes into the session's: letters, digits, '-', '_', '.'.
    #[arg(long, value_name = "NAME")]
    object: String,
    /// Find the exposure on a slow metering turn first.
    #[arg(long)]
    meter: bool,
    /// Do not ask before the table turns.
    #[arg(long)]
    yes: bool,
    #[command(flatten)]
    rig: RigArguments,
}

#[derive(Args)]
struct ServeArguments {
    /// Address and port to listen on; a port alone is this machine's own, which no other reaches.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8420")]
    listen: ListenAddress,
    /// What a client has to know, 16 to 128 letters, digits, '-' and '_' [default: random where other
    /// machines can reach the address]. Other accounts of this machine can see it: prefer --token-file.
    #[arg(long, value_name = "TOKEN", conflicts_with = "token_file")]
    token: Option<Token>,
    /// A file that holds the token, which only its owner and its group can read. Where there is none,
    /// it is made with a random token.
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// A name under which clients reach this machine, such as rig.local; may be given several times.
    #[arg(long = "name", value_name = "NAME")]
    names: Vec<String>,
    /// The folder in which data sets are made, where relit-mask and relit-extract are installed [default: the
    /// one that holds --root].
    #[arg(long, value_name = "DIR")]
    datasets: Option<PathBuf>,
    #[command(flatten)]
    rig: RigArguments,
}

#[derive(Args)]
struct RigArguments {
    /// The folder in which session folders are made.
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
    /// Frames a second.
    #[arg(long, value_name = "RATE", default_value_t = 30.0, value_parser = rate)]
    fps: f64,
    /// Frame size, such as 1920x1080 [default: the largest at that rate].
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size)]
    size: Option<(u32, u32)>,
    /// Pixel format: MJPG, H264, YUYV, NV12, RGB3, GREY or 8-bit Bayer [default: compressed before raw].
    #[arg(long, value_name = "FORMAT", value_parser = fourcc)]
    fourcc: Option<Fourcc>,
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
    /// Part of the pixels in the middle, per cent, that metering lets saturate.
    #[arg(long, value_name = "PERCENT", default_value_t = 0.5, value_parser = percent)]
    meter_clip: f64,
    /// Least voltage of the table's battery [default: not looked at].
    #[arg(long, value_name = "VOLTS", value_parser = volts)]
    min_battery: Option<f64>,
    /// Frames that may be missing or damaged in a take.
    #[arg(long, value_name = "N", default_value_t = 0)]
    max_dropped: u64,
    /// How often a take that came out bad is repeated; the bad ones are kept.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(0..=100))]
    retries: u32,
}

/// The command line as its manual shows it.
pub(crate) fn command() -> clap::Command {
    CommandLine::command()
}

/// Reads the command line; ends the program with exit code 2 where it is wrong.
pub(crate) fn parse() -> Arguments {
    let line = CommandLine::parse();
    let command = match line.verb {
        Verb::Devices => Command::Devices,
        Verb::Record(line) => Command::Record(Box::new(Record {
            settings: line.rig.into(),
            object: line.object,
            meter: line.meter,
            yes: line.yes,
        })),
        Verb::Serve(line) => Command::Serve(Box::new(Serve {
            settings: line.rig.into(),
            address: line.listen.socket(),
            token: line.token,
            token_file: line.token_file,
            names: line.listen.names(&line.names),
            datasets: line.datasets,
        })),
        Verb::Turntable(line) => Command::Turntable(line),
        Verb::Simulate(line) => Command::Simulate(line),
    };
    Arguments {
        json: line.json,
        command,
    }
}

impl From<RigArguments> for Settings {
    fn from(line: RigArguments) -> Self {
        let mut settings = Self::new(line.root, line.camera, line.turntable);
        settings.mode = ModePreference {
            fourcc: line.fourcc,
            size: line.size,
            fps: line.fps,
        };
        settings.wanted = ManualValues {
            exposure: line.exposure,
            gain: line.gain,
            white_balance: line.white_balance,
            focus: line.focus,
            power_line: None,
        };
        settings.degrees_per_second = line.degrees_per_second;
        settings.min_battery_v = line.min_battery;
        settings.max_dropped = line.max_dropped;
        settings.retries = line.retries;
        settings.meter_clip = line.meter_clip / 100.0;
        settings.commit = option_env!("RELIT_COMMIT").unwrap_or_default().to_owned();
        settings
    }
}

fn fourcc(text: &str) -> Result<Fourcc, String> {
    let known = || "give four characters such as MJPG, H264 or YUYV".to_owned();
    let fourcc = Fourcc(text.as_bytes().try_into().map_err(|_| known())?);
    match fourcc.pixel_format() {
        Some(_) => Ok(fourcc),
        None => Err(format!("{text} frames cannot be recorded: {}", known())),
    }
}

fn size(text: &str) -> Result<(u32, u32), String> {
    let side = |text: &str| text.parse().ok().filter(|&pixels: &u32| pixels > 0);
    let sides = text.split_once('x');
    sides
        .and_then(|(width, height)| Some((side(width)?, side(height)?)))
        .ok_or_else(|| format!("{text:?} is no size: write it as 1920x1080"))
}

fn figure(text: &str, low: f64, high: f64, what: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if (low..=high).contains(&value) => Ok(value),
        _ => Err(format!("give {what} from {low} to {high}")),
    }
}

fn speed(text: &str) -> Result<f64, String> {
    figure(text, 0.1, 360.0, "degrees a second")
}

fn rate(text: &str) -> Result<f64, String> {
    figure(text, 1.0, 1000.0, "frames a second")
}

fn percent(text: &str) -> Result<f64, String> {
    figure(text, 0.0, 100.0, "per cent")
}

fn volts(text: &str) -> Result<f64, String> {
    figure(text, 0.0, 100.0, "volts")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_written_with_an_x() {
        assert_eq!(size("1920x1080"), Ok((1920, 1080)));
        for text in ["", "1920", "0x5", "axb", "1920x1080x3"] {
            assert!(size(text).is_err(), "{text}");
        }
    }
}
