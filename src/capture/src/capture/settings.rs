//! What a person decides about captures, once for all takes.

use std::path::PathBuf;

use super::error::CaptureError;
use super::mode_preference::ModePreference;
use crate::state::CaptureSettings;
use relit_camera::CameraAddress;
use relit_camera::manual_controls::ManualValues;
use relit_turntable::TurntableAddress;

/// Where a capture's parts are and what it is to be like.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The folder in which sessions are made.
    pub root: PathBuf,
    /// The camera.
    pub camera: CameraAddress,
    /// The turntable.
    pub turntable: TurntableAddress,
    /// The camera's mode.
    pub mode: ModePreference,
    /// Values of its controls; what is not given stays as the camera has it.
    pub wanted: ManualValues,
    /// Speed of the turn, degrees a second.
    pub degrees_per_second: f64,
    /// Frames that may be missing of a take.
    pub max_dropped: u64,
    /// How often a take that came out bad is repeated.
    pub retries: u32,
    /// The commit that the program was built from, or nothing.
    pub commit: String,
}

impl Settings {
    /// Settings with the usual figures: 7.2 degrees/s at 30 frames/s, no frame may be missing, one
    /// more try.
    pub fn new(root: PathBuf, camera: CameraAddress, turntable: TurntableAddress) -> Self {
        Self {
            root,
            camera,
            turntable,
            mode: ModePreference::default(),
            wanted: ManualValues::default(),
            degrees_per_second: 7.2,
            max_dropped: 0,
            retries: 1,
            commit: String::new(),
        }
    }

    /// The same as everybody may see.
    pub fn shown(&self) -> CaptureSettings {
        CaptureSettings {
            root: self.root.display().to_string(),
            camera: self.camera.to_string(),
            turntable: self.turntable.to_string(),
            size: self.mode.size,
            fps: self.mode.fps,
            degrees_per_second: self.degrees_per_second,
            max_dropped: self.max_dropped,
            retries: self.retries,
        }
    }

    /// Whether neither camera nor table is real, so that the clock need not be either.
    pub fn is_rehearsal(&self) -> bool {
        matches!(self.camera, CameraAddress::Replay(_))
            && !matches!(self.turntable, TurntableAddress::Serial(_))
    }

    /// How many times faster than real time the rig runs at most; 0 means as fast as the machine
    /// computes. A simulated table's speed counts, else the replay's; a real camera or table goes
    /// by real time.
    ///
    /// # Errors
    /// [`CaptureError::Refused`] if one side is real and the other is to run faster.
    pub fn speed(&self) -> Result<f64, CaptureError> {
        let replayed = match &self.camera {
            CameraAddress::Replay(replay) => Some(replay.speed),
            _ => None,
        };
        let simulated = match &self.turntable {
            TurntableAddress::Simulated(table) => Some(table.speed),
            _ => None,
        };
        match (replayed, simulated, &self.turntable) {
            (Some(_), Some(table), _) => Ok(table),
            (Some(camera), None, TurntableAddress::None) => Ok(camera),
            (Some(1.0), None, _) | (None, Some(1.0), _) | (None, None, _) => Ok(1.0),
            _ => Err(CaptureError::Refused(
                "a real camera or turntable runs in real time: remove speed= from the other address"
                    .to_owned(),
            )),
        }
    }

    /// Frames of a turn at this rate.
    pub fn frames(&self, fps: f64) -> u64 {
        (360.0 / self.degrees_per_second * fps).round().max(1.0) as u64
    }

    /// The time of a turn, microseconds.
    pub fn turn_us(&self) -> i64 {
        (360.0 / self.degrees_per_second * 1e6).round() as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(camera: &str, table: &str) -> Settings {
        Settings::new(
            "/root".into(),
            camera.parse().unwrap(),
            table.parse().unwrap(),
        )
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
            assert!(matches!(refusal, CaptureError::Refused(_)), "{refusal}");
        }
    }

    #[test]
    fn a_turn_of_the_usual_speed_has_1500_frames() {
        assert_eq!(settings("replay:a", "none").frames(30.0), 1500);
        assert_eq!(settings("replay:a", "none").turn_us(), 50_000_000);
    }
}
