//! A camera's address as a person types it.

use std::collections::BTreeSet;
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use super::CameraError;

/// Fastest possible replay, times real time.
const FASTEST: f64 = 1000.0;
const NO_SCHEME: &str = "write v4l2:/dev/video0, nokhwa:0 or replay:PATH";
const NO_REST: &str = "nothing follows the colon";
const NO_PATH: &str = "a device is named by its path, such as /dev/video0";
/// Most frames in a list.
const MAX_FRAMES: usize = 10_000;

/// Which camera is meant: `v4l2:/dev/video0`, `nokhwa:0`, or `replay:PATH` with options as
/// `replay:PATH?speed=0&drop=7,8`. Options begin at the last question mark.
///
/// Options of a replay:
///
/// | option | meaning |
/// | --- | --- |
/// | `speed=1` | real time (the default); `K` is K times as fast, `0` as fast as it is read |
/// | `loop=1` | starts again at its end; counter and time stamps continue |
/// | `drop=7,8` | these frames are dropped: a gap in the counter |
/// | `damage=5` | the data of these frames are cut in half, unmarked |
/// | `flag=6` | the driver marks these frames as damaged |
/// | `unplug=100` | the camera is unplugged instead of this frame |
/// | `stall=20` | from this frame on, no frame is delivered |
/// | `resize=9` | from this frame on, frames have half the width and height (not for H.264) |
///
/// Frames are named by their position in the recording, 0-based, counted on where it loops.
#[derive(Debug, Clone, PartialEq)]
pub enum CameraAddress {
    /// A V4L2 device node.
    V4l2(PathBuf),
    /// The portable library's number of a camera.
    Nokhwa(u32),
    /// A recording.
    Replay(ReplayAddress),
}

/// A recording, and how it is replayed.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplayAddress {
    /// A session folder or a video file.
    pub path: PathBuf,
    /// How many times as fast as real time the rehearsal runs, at most 1000; 0: as fast as possible.
    /// Frames come by the clock: it has to be one [of this speed](relit_data::clock::Clock::at_speed).
    pub speed: f64,
    /// Whether it starts again at its end.
    pub repeat: bool,
    /// Faults to inject.
    pub faults: ReplayFaults,
}

/// Faults that a replay injects, for tests and rehearsals, at positions in the recording.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ReplayFaults {
    /// Frames that are dropped.
    pub drop: BTreeSet<u64>,
    /// Frames whose data are cut in half.
    pub damage: BTreeSet<u64>,
    /// Frames that the driver marks as damaged.
    pub flag: BTreeSet<u64>,
    /// The camera is unplugged instead of delivering this frame.
    pub unplug: Option<u64>,
    /// The frame from which on none is delivered.
    pub stall: Option<u64>,
    /// The frame from which on frames have half the width and height.
    pub resize: Option<u64>,
}

impl CameraAddress {
    /// `v4l2`, `nokhwa` or `replay`.
    pub fn backend(&self) -> &'static str {
        match self {
            Self::V4l2(_) => "v4l2",
            Self::Nokhwa(_) => "nokhwa",
            Self::Replay(_) => "replay",
        }
    }

    /// The device's path or number, or the recording's path, without options.
    pub fn device(&self) -> String {
        match self {
            Self::V4l2(path) | Self::Replay(ReplayAddress { path, .. }) => {
                path.display().to_string()
            }
            Self::Nokhwa(number) => number.to_string(),
        }
    }
}

impl FromStr for CameraAddress {
    type Err = CameraError;

    fn from_str(text: &str) -> Result<Self, CameraError> {
        parse(text).map_err(|fault| {
            CameraError::Address(format!("{text:?} is not a camera's address: {fault}"))
        })
    }
}

fn parse(text: &str) -> Result<CameraAddress, String> {
    let (scheme, rest) = text.split_once(':').ok_or(NO_SCHEME)?;
    match scheme {
        "v4l2" | "nokhwa" | "replay" if rest.is_empty() => Err(NO_REST.to_owned()),
        "v4l2" if rest.contains('\0') => Err(NO_PATH.to_owned()),
        "v4l2" => Ok(CameraAddress::V4l2(rest.into())),
        "nokhwa" => rest
            .parse()
            .map(CameraAddress::Nokhwa)
            .map_err(|_| "give a number from 0 after nokhwa:".to_owned()),
        "replay" => parse_replay(rest).map(CameraAddress::Replay),
        _ => Err(NO_SCHEME.to_owned()),
    }
}

fn parse_replay(text: &str) -> Result<ReplayAddress, String> {
    let (path, options) = text.rsplit_once('?').unwrap_or((text, ""));
    if path.is_empty() {
        return Err(NO_REST.to_owned());
    }
    if path.contains('\0') {
        return Err(NO_PATH.to_owned());
    }
    let mut replay = ReplayAddress {
        path: path.into(),
        speed: 1.0,
        repeat: false,
        faults: ReplayFaults::default(),
    };
    let faults = &mut replay.faults;
    let mut seen = BTreeSet::new();
    for option in options.split('&').filter(|option| !option.is_empty()) {
        let (name, value) = option.split_once('=').unwrap_or((option, ""));
        if !seen.insert(name) {
            return Err(format!("the option {name:?} is given twice"));
        }
        let wrong = || format!("{name} does not take the value {value:?}");
        let number = || value.parse().map(Some).map_err(|_| wrong());
        match name {
            "speed" => replay.speed = parse_speed(value).ok_or_else(wrong)?,
            "loop" => replay.repeat = parse_switch(value).ok_or_else(wrong)?,
            "drop" => faults.drop = parse_frames(value).ok_or_else(wrong)?,
            "damage" => faults.damage = parse_frames(value).ok_or_else(wrong)?,
            "flag" => faults.flag = parse_frames(value).ok_or_else(wrong)?,
            "unplug" => faults.unplug = number()?,
            "stall" => faults.stall = number()?,
            "resize" => faults.resize = number()?,
            _ => {
                return Err(format!(
                    "the option {name:?} is unknown; the options are speed, loop, drop, damage, flag, unplug, resize and stall"
                ));
            }
        }
    }
    Ok(replay)
}

fn parse_speed(text: &str) -> Option<f64> {
    let usable =
        |times: &f64| *times == 0.0 || (times.is_normal() && (0.0..=FASTEST).contains(times));
    text.parse().ok().filter(usable)
}

fn parse_switch(text: &str) -> Option<bool> {
    match text {
        "0" => Some(false),
        "1" => Some(true),
        _ => None,
    }
}

fn parse_frames(text: &str) -> Option<BTreeSet<u64>> {
    let frames: BTreeSet<u64> = text
        .split(',')
        .take(MAX_FRAMES + 1)
        .map(|number| number.parse().ok())
        .collect::<Option<_>>()?;
    (frames.len() <= MAX_FRAMES).then_some(frames)
}

/// The address without options.
impl fmt::Display for CameraAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.backend(), self.device())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn no_text_makes_the_parser_panic(text in ".{0,60}", options in "[a-z0-9=&,?.-]{0,40}") {
            let _ = text.parse::<CameraAddress>();
            let _ = format!("replay:{text}?{options}").parse::<CameraAddress>();
        }
    }

    #[test]
    fn addresses_are_those_of_the_manual() {
        let read = |text: &str| text.parse::<CameraAddress>().unwrap();
        assert_eq!(
            read("v4l2:/dev/video0"),
            CameraAddress::V4l2("/dev/video0".into())
        );
        assert_eq!(read("nokhwa:3"), CameraAddress::Nokhwa(3));
        let plain = ReplayAddress {
            path: "clip.mp4".into(),
            speed: 1.0,
            repeat: false,
            faults: ReplayFaults::default(),
        };
        assert_eq!(read("replay:clip.mp4"), CameraAddress::Replay(plain));
        let all = "replay:a b?speed=0&loop=1&drop=7,8&damage=5&flag=6&unplug=100&stall=20&resize=9";
        let CameraAddress::Replay(replay) = read(all) else {
            panic!("{all} is a replay");
        };
        let faults = &replay.faults;
        assert_eq!(
            (replay.path, replay.speed, replay.repeat),
            ("a b".into(), 0.0, true)
        );
        assert_eq!(faults.drop, BTreeSet::from([7, 8]));
        assert_eq!(
            (faults.unplug, faults.stall, faults.resize),
            (Some(100), Some(20), Some(9))
        );
        assert_eq!(read(all).to_string(), "replay:a b");
    }

    #[test]
    fn a_wrong_address_names_the_mistake() {
        for (text, fault) in [
            ("/dev/video0", NO_SCHEME),
            ("usb:0", NO_SCHEME),
            ("v4l2:", NO_REST),
            ("replay:?speed=1", NO_REST),
            ("v4l2:a\0b", NO_PATH),
            ("nokhwa:-1", "nokhwa:"),
            ("replay:a?fast=1", "\"fast\""),
            ("replay:a?loop=1&loop=1", "\"loop\""),
        ] {
            let found = parse(text).unwrap_err();
            assert!(found.contains(fault), "{text}: {found}");
        }
        for option in [
            "speed=-1",
            "speed=NaN",
            "speed=1e9",
            "speed",
            "loop=yes",
            "drop=",
            "drop=1,,2",
            "unplug=x",
        ] {
            let found = parse(&format!("replay:a?{option}")).unwrap_err();
            let name = option.split('=').next().unwrap();
            assert!(found.contains(name), "{option}: {found}");
        }
    }
}
