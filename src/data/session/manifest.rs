//! The manifest: `session.json`, schema `relit.session/1`.

use std::collections::BTreeMap;

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::is_session_name;
use crate::rig::{CAMERA_ELEVATIONS_DEG, RigFacts};
use crate::text;

/// The schema that this version reads and writes.
pub const MANIFEST_SCHEMA: &str = "relit.session/1";

/// The description of a session.
#[derive(Debug, Clone, PartialEq)]
pub struct Manifest {
    /// The session's name: `<UTC date>T<time>Z-<object>`.
    pub id: String,
    /// The object's name.
    pub object: String,
    /// When the capture began, UTC.
    pub created: Timestamp,
    /// Whether the capture is running, complete or aborted.
    pub status: Status,
    /// The camera and its settings.
    pub camera: CameraFacts,
    /// The turntable; `None` if the camera recorded without one.
    pub turntable: Option<TurntableFacts>,
    /// What is known of the rig; `None` where it was not measured.
    pub rig: Option<RigFacts>,
    /// The video file.
    pub video: VideoFacts,
    /// What went wrong during the capture, in order of time.
    pub faults: Vec<Fault>,
    /// The program that recorded.
    pub software: SoftwareFacts,
    /// What a person noted of the take.
    pub note: Option<String>,
    /// How a person rated the take, 1 to 5.
    pub rating: Option<u8>,
}

/// The state of a capture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Status {
    /// Running, or interrupted and not yet salvaged.
    Recording,
    /// Finished, with all frames.
    Complete,
    /// Ended early or salvaged, for this reason.
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

/// Something that went wrong during a capture.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault {
    /// When, microseconds of the driver's monotonic clock.
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

/// What is wrong in a manifest.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ManifestFault {
    /// Not JSON, or a field is missing or has another type.
    #[error("{0}")]
    Json(#[from] serde_json::Error),
    /// Another schema, probably from a newer version.
    #[error("its schema is {found:?}, and this version reads {MANIFEST_SCHEMA:?}")]
    Schema {
        /// The schema in the file.
        found: String,
    },
    /// The id cannot be a session's name.
    #[error("its id {0:?} cannot be a session's name")]
    Id(String),
    /// The object has no name.
    #[error("its object is empty")]
    NoObject,
    /// `status` has an unknown value.
    #[error("its status {0:?} is none of \"recording\", \"complete\", \"aborted\"")]
    Status(String),
    /// Aborted without a reason.
    #[error("its status is \"aborted\", but it has no reason")]
    NoReason,
    /// A field about the video of a complete session is missing.
    #[error("its status is \"complete\", but video.{0} is missing")]
    Incomplete(&'static str),
    /// The video's file name is a path.
    #[error("its video.file {0:?} is not a plain file name")]
    VideoName(String),
    /// The hash is malformed.
    #[error("its video.blake3 {0:?} is not a hash of 64 hexadecimal digits")]
    Hash(String),
    /// A rating that does not exist.
    #[error("its rating is {0}, but must be 1 to 5")]
    Rating(u8),
    /// A number is not positive and finite.
    #[error("its {field} is {value}, but must be positive")]
    Number {
        /// The field.
        field: &'static str,
        /// The value in the file.
        value: f64,
    },
    /// The camera's elevation cannot be.
    #[error("its rig.camera_elevation_deg is {0}, but must be 0 to 89")]
    Elevation(f64),
}

impl Manifest {
    /// Reads a manifest from the bytes of its file.
    ///
    /// # Errors
    /// [`ManifestFault`] with the first fault found.
    pub fn from_json(bytes: &[u8]) -> Result<Self, ManifestFault> {
        let bytes = text::unmarked(bytes);
        // The schema first: complaints about the fields of another version would mislead.
        let schema: SchemaOnly = serde_json::from_slice(bytes)?;
        if schema.schema != MANIFEST_SCHEMA {
            return Err(ManifestFault::Schema {
                found: schema.schema,
            });
        }
        let file: ManifestFile = serde_json::from_slice(bytes)?;
        let status = match (file.status.as_str(), file.reason) {
            ("recording", _) => Status::Recording,
            ("complete", _) => Status::Complete,
            ("aborted", Some(reason)) => Status::Aborted(reason),
            ("aborted", None) => return Err(ManifestFault::NoReason),
            _ => return Err(ManifestFault::Status(file.status)),
        };
        let manifest = Self {
            id: file.id,
            object: file.object,
            created: file.created,
            status,
            camera: file.camera,
            turntable: file.turntable,
            rig: file.rig,
            video: file.video,
            faults: file.faults,
            software: file.software,
            note: file.note,
            rating: file.rating,
        };
        manifest.check()?;
        Ok(manifest)
    }

    /// The manifest as the bytes of its file: indented JSON with a final line feed.
    ///
    /// # Errors
    /// As [`Self::from_json`]: what could not be read back is not written.
    pub fn to_json(&self) -> Result<Vec<u8>, ManifestFault> {
        self.check()?;
        let (status, reason) = match &self.status {
            Status::Recording => ("recording", None),
            Status::Complete => ("complete", None),
            Status::Aborted(reason) => ("aborted", Some(reason.clone())),
        };
        let file = ManifestFile {
            schema: MANIFEST_SCHEMA.to_owned(),
            id: self.id.clone(),
            object: self.object.clone(),
            created: self.created,
            status: status.to_owned(),
            reason,
            camera: self.camera.clone(),
            turntable: self.turntable.clone(),
            rig: self.rig,
            video: self.video.clone(),
            faults: self.faults.clone(),
            software: self.software.clone(),
            note: self.note.clone(),
            rating: self.rating,
        };
        let mut bytes = serde_json::to_vec_pretty(&file)?;
        bytes.push(b'\n');
        Ok(bytes)
    }

    fn check(&self) -> Result<(), ManifestFault> {
        if !is_session_name(&self.id) {
            return Err(ManifestFault::Id(self.id.clone()));
        }
        if self.object.trim().is_empty() {
            return Err(ManifestFault::NoObject);
        }
        let file = &self.video.file;
        if file.is_empty() || file == "." || file == ".." || file.contains(['/', '\\', '\0']) {
            return Err(ManifestFault::VideoName(file.clone()));
        }
        if let Some(hash) = &self.video.blake3
            && (hash.len() != 64 || !hash.bytes().all(|b| b.is_ascii_hexdigit()))
        {
            return Err(ManifestFault::Hash(hash.clone()));
        }
        if let Some(rating) = self.rating
            && !(1..=5).contains(&rating)
        {
            return Err(ManifestFault::Rating(rating));
        }
        positive("camera.fps", self.camera.fps)?;
        if let Some(table) = &self.turntable {
            positive("turntable.degrees_per_second", table.degrees_per_second)?;
            positive("turntable.steps_per_degree", table.steps_per_degree)?;
        }
        if let Some(degrees) = self.rig.and_then(|rig| rig.camera_elevation_deg)
            && !CAMERA_ELEVATIONS_DEG.contains(&degrees)
        {
            return Err(ManifestFault::Elevation(degrees));
        }
        if self.status == Status::Complete {
            let video = &self.video;
            video.frames.ok_or(ManifestFault::Incomplete("frames"))?;
            video.bytes.ok_or(ManifestFault::Incomplete("bytes"))?;
            video
                .blake3
                .as_ref()
                .ok_or(ManifestFault::Incomplete("blake3"))?;
        }
        Ok(())
    }
}

/// The object's name in a session's id: what follows `<UTC date>T<time>Z-`, or the whole id if it does
/// not have that form.
#[must_use]
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

fn positive(field: &'static str, value: f64) -> Result<(), ManifestFault> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(ManifestFault::Number { field, value })
    }
}

#[derive(Deserialize)]
struct SchemaOnly {
    schema: String,
}

/// The manifest as it is in the file, where `status` and `reason` are two fields.
#[derive(Serialize, Deserialize)]
struct ManifestFile {
    schema: String,
    id: String,
    object: String,
    created: Timestamp,
    status: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
    camera: CameraFacts,
    turntable: Option<TurntableFacts>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rig: Option<RigFacts>,
    video: VideoFacts,
    #[serde(default)]
    faults: Vec<Fault>,
    software: SoftwareFacts,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    note: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rating: Option<u8>,
}
