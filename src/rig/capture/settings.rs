//! What a person decides about captures, once for all takes.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use super::error::Refusal;
use crate::camera::hold::ManualValues;
use crate::camera::{CameraAddress, Fourcc, Mode, ModeRequest, Rate, Rates, ReplaySpeed};
use crate::lockfile::{self, LockError, LockFile};
use crate::turntable;

/// Formats from the one that is preferred: what the camera compresses by frames comes first.
const PREFERRED: [Fourcc; 5] = [
    Fourcc::MJPG,
    Fourcc::H264,
    Fourcc::YUYV,
    Fourcc::NV12,
    Fourcc::RGB3,
];
/// Rates that differ by less count as the same, frames a second: 29.97 is asked for as 30.
const SAME_RATE: f64 = 0.05;

/// Where a capture's parts are and what it is to be like.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The folder in which sessions are made.
    pub root: PathBuf,
    /// The camera.
    pub camera: CameraAddress,
    /// The turntable.
    pub turntable: turntable::TurntableAddress,
    /// The camera's mode.
    pub mode: ModePreference,
    /// Values of its controls; what is not given stays as the camera has it.
    pub wanted: ManualValues,
    /// Speed of the turn, degrees a second.
    pub degrees_per_second: f64,
    /// Least voltage of the table's battery.
    pub min_battery_v: Option<f64>,
    /// Frames that may be missing of a take.
    pub max_dropped: u64,
    /// How often a take that came out bad is repeated.
    pub retries: u32,
    /// The part of the pixels in the middle that metering lets saturate, 0 to 1.
    pub meter_clip: f64,
    /// Where those who use cameras and serial ports leave their locks.
    pub runtime_folder: PathBuf,
    /// The commit that the program was built from, or nothing.
    pub commit: String,
}

impl Settings {
    /// Settings with the usual figures: 7.2 degrees/s at 30 frames/s, no frame may be missing, one
    /// more try.
    #[must_use]
    pub fn new(
        root: PathBuf,
        camera: CameraAddress,
        turntable: turntable::TurntableAddress,
    ) -> Self {
        Self {
            root,
            camera,
            turntable,
            mode: ModePreference::default(),
            wanted: ManualValues::default(),
            degrees_per_second: 7.2,
            min_battery_v: None,
            max_dropped: 0,
            retries: 1,
            meter_clip: 0.005,
            runtime_folder: lockfile::standard_folder(),
            commit: String::new(),
        }
    }

    /// Takes the camera for this process; `None` for one that any number of programs can have.
    ///
    /// # Errors
    /// [`LockError::Held`] with the holder's process number, or what the file system answers.
    pub fn lock_camera(&self) -> Result<Option<LockFile>, LockError> {
        match &self.camera {
            CameraAddress::V4l2(path) => LockFile::of_device(path, &self.runtime_folder).map(Some),
            _ => Ok(None),
        }
    }

    /// How many times faster than real time the rig runs at most; 0 means as fast as the machine
    /// computes. A simulated table's speed counts, else the replay's; a real camera or table goes
    /// by real time.
    ///
    /// # Errors
    /// [`Refusal::Pace`] where one side is real and the other is to run faster.
    pub fn speed(&self) -> Result<f64, Refusal> {
        use turntable::TurntableAddress as Table;
        let replayed = match &self.camera {
            CameraAddress::Replay { speed, .. } => Some(match speed {
                ReplaySpeed::AsRead => 0.0,
                ReplaySpeed::Times(times) => *times,
            }),
            _ => None,
        };
        let simulated = match &self.turntable {
            Table::Simulated(table) => Some(table.speed),
            _ => None,
        };
        match (replayed, simulated, &self.turntable) {
            (Some(_), Some(table), _) => Ok(table),
            (Some(camera), None, Table::None) => Ok(camera),
            (Some(1.0), None, _) | (None, Some(1.0), _) | (None, None, _) => Ok(1.0),
            _ => Err(Refusal::Pace),
        }
    }

    /// Frames of a turn at this rate.
    #[must_use]
    pub fn frames(&self, fps: f64) -> u64 {
        (360.0 / self.degrees_per_second * fps).round().max(1.0) as u64
    }

    /// The time of a turn, microseconds.
    #[must_use]
    pub fn turn_us(&self) -> i64 {
        (360.0 / self.degrees_per_second * 1e6).round() as i64
    }
}

/// What is wished of a camera's mode; what is not given is chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModePreference {
    /// Pixel format.
    pub fourcc: Option<Fourcc>,
    /// Frame size.
    pub size: Option<FrameSize>,
    /// Frames a second.
    pub fps: f64,
}

impl Default for ModePreference {
    fn default() -> Self {
        Self {
            fourcc: None,
            size: None,
            fps: 30.0,
        }
    }
}

impl fmt::Display for ModePreference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.fourcc {
            Some(fourcc) => write!(f, "{fourcc}")?,
            None => f.write_str("any format")?,
        }
        match self.size {
            Some(size) => write!(f, " {size}")?,
            None => f.write_str(" of any size")?,
        }
        write!(f, " at {} frames/s", self.fps)
    }
}

/// Width and height of frames, pixels, written `1920x1080`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameSize {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
}

impl fmt::Display for FrameSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

impl FromStr for FrameSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let side = |text: &str| text.parse().ok().filter(|&pixels: &u32| pixels > 0);
        let sides = text.split_once('x');
        sides
            .and_then(|(width, height)| {
                Some(Self {
                    width: side(width)?,
                    height: side(height)?,
                })
            })
            .ok_or_else(|| format!("{text:?} is no size: write it as 1920x1080"))
    }
}

impl ModePreference {
    /// The mode to ask the camera for: of those that fulfil the wish the largest, and of those the
    /// one whose frames take least room.
    ///
    /// # Errors
    /// [`Refusal::NoMode`] with what there is.
    pub fn choose(&self, modes: &[Mode]) -> Result<ModeRequest, Refusal> {
        let requests = modes.iter().filter_map(|mode| self.of(mode));
        let rank = |fourcc: Fourcc| PREFERRED.iter().position(|&known| known == fourcc);
        requests
            .min_by_key(|request| {
                let pixels = u64::from(request.width) * u64::from(request.height);
                let rank = rank(request.fourcc).unwrap_or(PREFERRED.len());
                (std::cmp::Reverse(pixels), rank)
            })
            .ok_or_else(|| Refusal::NoMode {
                wish: *self,
                offered: modes.iter().map(Mode::to_string).collect(),
            })
    }

    fn of(&self, mode: &Mode) -> Option<ModeRequest> {
        if self.fourcc.is_some_and(|fourcc| fourcc != mode.fourcc) {
            return None;
        }
        let (width, height) = match self.size {
            Some(size) if mode.sizes.contains(size.width, size.height) => (size.width, size.height),
            Some(_) => return None,
            None => mode.sizes.largest(),
        };
        Some(ModeRequest {
            fourcc: mode.fourcc,
            width,
            height,
            rate: self.rate(&mode.rates)?,
        })
    }

    fn rate(&self, rates: &Rates) -> Option<Rate> {
        match rates {
            Rates::List(rates) => {
                let distance = |rate: &Rate| (rate.per_second() - self.fps).abs();
                let nearest = rates.iter().copied();
                let nearest = nearest.min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
                (distance(&nearest) < SAME_RATE).then_some(nearest)
            }
            Rates::Range { slowest, fastest } => {
                let rate = Rate::from_per_second(self.fps)?;
                let (low, high) = (slowest.per_second(), fastest.per_second());
                (low - SAME_RATE..=high + SAME_RATE)
                    .contains(&self.fps)
                    .then_some(rate)
            }
            Rates::Unknown => Rate::from_per_second(self.fps),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Sizes;

    fn settings(camera: &str, table: &str) -> Settings {
        Settings::new(
            "/root".into(),
            camera.parse().unwrap(),
            table.parse().unwrap(),
        )
    }

    fn mode(fourcc: Fourcc, width: u32, height: u32, rates: &[u32]) -> Mode {
        Mode {
            fourcc,
            sizes: Sizes::One(width, height),
            rates: Rates::List(
                rates
                    .iter()
                    .filter_map(|&rate| Rate::new(rate, 1))
                    .collect(),
            ),
        }
    }

    #[test]
    fn a_rehearsal_runs_at_the_tables_speed() {
        for (camera, table, speed) in [
            ("replay:a?speed=3", "sim:?speed=5", 5.0),
            ("replay:a", "sim:?speed=0", 0.0),
            ("replay:a?speed=0", "none", 0.0),
            ("replay:a?speed=7", "none", 7.0),
            ("v4l2:/dev/video0", "sim:", 1.0),
            ("replay:a", "serial:/dev/ttyUSB0", 1.0),
            ("v4l2:/dev/video0", "serial:", 1.0),
        ] {
            let found = settings(camera, table).speed().unwrap();
            assert_eq!(found, speed, "{camera} {table}");
        }
    }

    #[test]
    fn what_is_real_does_not_run_faster_than_time() {
        for (camera, table) in [
            ("v4l2:/dev/video0", "sim:?speed=2"),
            ("replay:a?speed=2", "serial:"),
            ("replay:a?speed=0", "serial:"),
        ] {
            let refusal = settings(camera, table).speed().unwrap_err();
            assert!(matches!(refusal, Refusal::Pace));
        }
    }

    #[test]
    fn the_largest_mode_at_the_rate_is_chosen_and_compressed_ones_before_raw_ones() {
        let modes = [
            mode(Fourcc::YUYV, 1920, 1080, &[5, 30]),
            mode(Fourcc::MJPG, 1920, 1080, &[30, 60]),
            mode(Fourcc::MJPG, 3840, 2160, &[15]),
        ];
        let chosen = ModePreference::default().choose(&modes).unwrap();
        assert_eq!(chosen.to_string(), "MJPG:1920x1080@30");
        let wish = ModePreference {
            fourcc: Some(Fourcc::YUYV),
            ..ModePreference::default()
        };
        assert_eq!(wish.choose(&modes).unwrap().fourcc, Fourcc::YUYV);
        let wish = ModePreference {
            fps: 15.0,
            ..ModePreference::default()
        };
        assert_eq!(wish.choose(&modes).unwrap().width, 3840);
    }

    #[test]
    fn a_wish_that_no_mode_fulfils_is_told_with_what_there_is() {
        let modes = [mode(Fourcc::MJPG, 640, 480, &[25])];
        let error = ModePreference::default()
            .choose(&modes)
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("any format of any size at 30 frames/s"),
            "{error}"
        );
        assert!(error.contains("MJPG 640x480, 25 frames/s"), "{error}");
    }

    #[test]
    fn a_turn_of_the_usual_speed_has_1500_frames() {
        assert_eq!(settings("replay:a", "none").frames(30.0), 1500);
        assert_eq!(settings("replay:a", "none").turn_us(), 50_000_000);
    }

    #[test]
    fn sizes_are_written_with_an_x() {
        assert_eq!(
            "1920x1080".parse(),
            Ok(FrameSize {
                width: 1920,
                height: 1080
            })
        );
        for text in ["", "1920", "0x5", "axb", "1920x1080x3"] {
            assert!(text.parse::<FrameSize>().is_err(), "{text}");
        }
    }
}
