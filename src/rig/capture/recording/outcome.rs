//! What the camera's thread and the writer's thread leave when a recording has ended.

use std::time::Duration;

use super::cutter::TurnCount;
use super::environment_light::EnvironmentLight;
use super::error::RecordingError;
use super::finding::Finding;
use crate::camera::{CameraError, FrameFault};
use relit_data::session::SessionWriter;

/// Why a recording ended.
#[derive(Debug, thiserror::Error)]
pub enum End {
    /// The turn is over.
    #[error("the turn is over")]
    Over,
    /// It was asked to stop.
    #[error("it was stopped before the turn was over")]
    Stopped,
    /// The camera failed.
    #[error(transparent)]
    Camera(CameraError),
    /// The camera fell silent.
    #[error("the camera gave no frame for {:.1} s: check its cable", .waited.as_secs_f64())]
    Stalled {
        /// How long was waited.
        waited: Duration,
    },
    /// The camera delivers another size than agreed.
    #[error("the camera changed what it delivers: {0}")]
    OtherSize(FrameFault),
    /// The disk took no more.
    #[error("the disk took no more")]
    Disk,
    /// A replayed recording is over.
    #[error("the recording that plays the camera is over")]
    SourceOver,
    /// Something other than the recorder ended the take, such as the table or a person.
    #[error("{0}")]
    Interrupted(String),
}

/// What the camera's thread leaves.
pub(super) struct CameraOutcome {
    pub(super) end: End,
    pub(super) count: TurnCount,
    /// What is wrong with delivered frames.
    pub(super) findings: Vec<Finding>,
}

/// What the writer's thread leaves.
pub(super) struct WriterOutcome {
    pub(super) session: SessionWriter,
    /// For each frame of the video its index among the delivered frames of the turn; `None` before
    /// the turn.
    pub(super) delivered: Vec<Option<usize>>,
    /// What is wrong with delivered frames.
    pub(super) findings: Vec<Finding>,
    /// What a sample of the turn's frames says of the environment light.
    pub(super) light: EnvironmentLight,
    /// Bytes of video.
    pub(super) bytes: u64,
    /// What the disk refused.
    pub(super) failure: Option<RecordingError>,
}
