//! The manifest: `session.json`, schema `relit.session/1`.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{MANIFEST_FILE, SessionError, is_session_name};
use crate::rig::{CAMERA_ELEVATIONS_DEG, RigFacts};
use crate::text;

/// The schema that this version reads and writes.
pub const MANIFEST_SCHEMA: &str = "relit.session/1";

/// The description of a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// The session's name: `<UTC date>T<time>Z-<object>`.
    pub id: String,
    /// The object's name.
    pub object: String,
    /// When the capture began, UTC.
    pub created: Timestamp,
    /// Whether the capture is running, complete or aborted.
    #[serde(flatten)]
    pub status: Status,
    /// The camera and its settings.
    pub camera: CameraFacts,
    /// The turntable; `None` if the camera recorded without one.
    pub turntable: Option<TurntableFacts>,
    /// What is known of the rig; `None` if it was not measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rig: Option<RigFacts>,
    /// The video file.
    pub video: VideoFacts,
    /// What went wrong during the capture, in order of time.
    #[serde(default)]
    pub faults: Vec<Fault>,
    /// The program that recorded.
    pub software: SoftwareFacts,
    /// What a person noted of the take.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// How a person rated the take, 1 to 5.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rating: Option<u8>,
}

/// The state of a capture: in the file `status`, and `reason` where it has one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "status", content = "reason", rename_all = "lowercase")]
pub enum Status {
    /// Running, or interrupted and not yet recovered.
    Recording,
    /// Finished, with all frames.
    Complete,
    /// Ended early or recovered, for this reason.
    Aborted(String),
}

/// The camera and its settings, as read back from the device.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CameraFacts {
    /// `v4l2`, `nokhwa` or `replay`.
    pub backend: String,
    /// The device's path or number.
    pub device: String,
    /// The device's own name.
    pub name: String,
    /// The pixel format's four characters, such as `MJPG`.
    pub fourcc: String,
    /// Frame width, pixels.
    pub width: u32,
    /// Frame height, pixels.
    pub height: u32,
    /// Nominal frames per second.
    pub fps: f64,
    /// What stamped the frames; not written where it is the driver.
    #[serde(default, skip_serializing_if = "FrameClock::is_driver")]
    pub clock: FrameClock,
    /// Every control's value, by name.
    pub controls: BTreeMap<String, Value>,
}

/// What stamped the frames of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FrameClock {
    /// The camera's driver, when the frame was exposed or its last data came.
    #[default]
    Driver,
    /// The recording program, when it got the frame: later by what the camera and the system took,
    /// and less regular.
    Host,
}

impl FrameClock {
    fn is_driver(&self) -> bool {
        *self == Self::Driver
    }
}

/// The turntable and its settings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TurntableFacts {
    /// The serial port.
    pub port: String,
    /// The firmware and version that the controller reports.
    pub firmware: String,
    /// Speed of the constant part, degrees a second.
    pub degrees_per_second: f64,
    /// Motor steps a degree.
    pub steps_per_degree: f64,
}

/// The video file. The last three fields are `None` only while the capture is not complete.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct VideoFacts {
    /// Its file name in the session folder.
    pub file: String,
    /// `mjpeg`, `h264` or `ffv1`.
    pub codec: String,
    /// Number of frames.
    #[serde(default)]
    pub frames: Option<u64>,
    /// Its size, bytes.
    #[serde(default)]
    pub bytes: Option<u64>,
    /// Its BLAKE3 hash, 64 hexadecimal digits.
    #[serde(default)]
    pub blake3: Option<String>,
}

impl Manifest {
    /// What to know of the whole take, such as light that is too even: the faults without a time.
    pub fn notes(&self) -> Vec<String> {
        let whole = self.faults.iter().filter(|fault| fault.t_us == 0);
        whole.map(|fault| fault.what.clone()).collect()
    }
}

/// Something that went wrong during a capture.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault {
    /// When, microseconds of the driver's monotonic clock; 0 if it concerns the whole take.
    pub t_us: i64,
    /// What, for a person.
    pub what: String,
}

/// The program that recorded.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SoftwareFacts {
    /// Its version.
    pub version: String,
    /// The commit it was built from, or empty.
    pub commit: String,
}

impl Manifest {
    /// Reads the manifest of a session folder.
    ///
    /// # Errors
    /// [`SessionError::Io`], or [`SessionError::Unusable`].
    pub fn read(folder: &Path) -> Result<Self, SessionError> {
        let path = folder.join(MANIFEST_FILE);
        let bytes = fs::read(&path).map_err(SessionError::io(&path, "read"))?;
        Self::from_json(&bytes).map_err(|fault| SessionError::manifest(&path, &fault))
    }

    /// Reads a manifest from the bytes of its file.
    ///
    /// # Errors
    /// The first fault found.
    pub fn from_json(bytes: &[u8]) -> Result<Self, String> {
        let bytes = text::unmarked(bytes);
        let no_manifest = |error: serde_json::Error| error.to_string();
        // The schema first: complaints about the fields of another version would mislead.
        let SchemaOnly { schema } = serde_json::from_slice(bytes).map_err(no_manifest)?;
        if schema != MANIFEST_SCHEMA {
            return Err(format!(
                "its schema is {schema:?}, and this version reads {MANIFEST_SCHEMA:?}"
            ));
        }
        let manifest: Self = serde_json::from_slice(bytes).map_err(no_manifest)?;
        manifest.check()?;
        Ok(manifest)
    }

    /// The manifest as the bytes of its file: indented JSON with a final line feed.
    ///
    /// # Errors
    /// As [`Self::from_json`]: what could not be read back is not written.
    pub fn to_json(&self) -> Result<Vec<u8>, String> {
        self.check()?;
        let written = WrittenManifest {
            schema: MANIFEST_SCHEMA,
            manifest: self,
        };
        let mut bytes = serde_json::to_vec_pretty(&written).map_err(|error| error.to_string())?;
        bytes.push(b'\n');
        Ok(bytes)
    }

    fn check(&self) -> Result<(), String> {
        let Self { id, video, .. } = self;
        let file = &video.file;
        let is_path =
            file.is_empty() || file == "." || file == ".." || file.contains(['/', '\\', '\0']);
        let is_hash =
            |hash: &String| hash.len() == 64 && hash.bytes().all(|byte| byte.is_ascii_hexdigit());
        let missing = [
            ("frames", video.frames.is_none()),
            ("bytes", video.bytes.is_none()),
            ("blake3", video.blake3.is_none()),
        ];
        let missing = missing.iter().find(|(_, is_missing)| *is_missing);
        let table = self.turntable.as_ref();
        let numbers = [
            ("camera.fps", Some(self.camera.fps)),
            (
                "turntable.degrees_per_second",
                table.map(|table| table.degrees_per_second),
            ),
            (
                "turntable.steps_per_degree",
                table.map(|table| table.steps_per_degree),
            ),
        ];
        let is_wrong = |value: f64| !value.is_finite() || value <= 0.0;
        let wrong = numbers
            .iter()
            .find_map(|&(field, value)| Some((field, value.filter(|&value| is_wrong(value))?)));
        let elevation = self.rig.and_then(|rig| rig.camera_elevation_deg);
        if !is_session_name(id) {
            Err(format!("its id {id:?} cannot be a session's name"))
        } else if self.object.trim().is_empty() {
            Err("its object is empty".to_owned())
        } else if is_path {
            Err(format!("its video.file {file:?} is not a plain file name"))
        } else if let Some(hash) = video.blake3.as_ref().filter(|hash| !is_hash(hash)) {
            Err(format!(
                "its video.blake3 {hash:?} is not a hash of 64 hexadecimal digits"
            ))
        } else if let Some(rating) = self.rating.filter(|rating| !(1..=5).contains(rating)) {
            Err(format!("its rating is {rating}, but must be 1 to 5"))
        } else if let Some((field, value)) = wrong {
            Err(format!("its {field} is {value}, but must be positive"))
        } else if let Some(degrees) = elevation.filter(|at| !CAMERA_ELEVATIONS_DEG.contains(at)) {
            Err(format!(
                "its rig.camera_elevation_deg is {degrees}, but must be 0 to 89"
            ))
        } else if let (Status::Complete, Some((field, _))) = (&self.status, missing) {
            Err(format!(
                "its status is \"complete\", but video.{field} is missing"
            ))
        } else {
            Ok(())
        }
    }
}

/// The object's name in a session's id: what follows `<UTC date>T<time>Z-`, or the whole id if it does
/// not have that form.
pub fn object_of(id: &str) -> &str {
    let Some((stamp, object)) = id.split_once("Z-") else {
        return id;
    };
    let is_stamp = stamp.len() == 15
        && stamp.bytes().enumerate().all(|(at, byte)| match at {
            8 => byte == b'T',
            _ => byte.is_ascii_digit(),
        });
    if is_stamp && !object.is_empty() {
        object
    } else {
        id
    }
}

#[derive(Deserialize)]
struct SchemaOnly {
    schema: String,
}

/// What the file holds.
#[derive(Serialize)]
struct WrittenManifest<'a> {
    schema: &'static str,
    #[serde(flatten)]
    manifest: &'a Manifest,
}
