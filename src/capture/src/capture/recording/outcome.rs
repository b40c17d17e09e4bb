//! What the camera's thread and the writer's thread leave when a recording has ended.

use super::environment_light::EnvironmentLight;
use super::error::RecordingError;
use super::finding::Finding;
use super::trimmer::TurnCount;
use relit_data::session::SessionWriter;

/// Why a recording ended.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EndReason {
    /// The turn is over.
    #[error("the turn is over")]
    Over,
    /// It was asked to stop.
    #[error("it was stopped before the turn was over")]
    Stopped,
    /// Camera or disk failed.
    #[error("{0}")]
    Failed(String),
    /// Something other than the recorder ended the take, such as the table.
    #[error("{0}")]
    Interrupted(String),
    /// Somebody ended the take on purpose, which is not a fault.
    #[error("{0}")]
    OnPurpose(String),
}

/// What the camera's thread leaves.
pub(super) struct CameraOutcome {
    pub(super) end: EndReason,
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
    /// What a sample of the turn's frames says about the environment light.
    pub(super) light: EnvironmentLight,
    /// Bytes of video.
    pub(super) bytes: u64,
    /// What the disk refused.
    pub(super) failure: Option<RecordingError>,
}
