//! What the camera's thread and the writer's thread leave when a recording has ended.

use std::time::Duration;

use super::cutter::TurnCount;
use super::error::RecordingError;
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

/// Why a delivered frame of the turn is not in the video as it should be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FrameIssue {
    /// It was dropped, as the disk was too slow.
    QueueFull,
    /// It could not be recorded: empty, or before any key frame.
    Unusable,
    /// It was recorded as it came.
    Damaged(FrameFault),
}

impl FrameIssue {
    /// Whether the frame is not in the video.
    pub(super) fn is_loss(self) -> bool {
        !matches!(self, Self::Damaged(_))
    }

    /// In words; `n`: the frame of the video that it is about, or that comes next.
    pub(super) fn at(self, n: usize) -> String {
        match self {
            Self::QueueFull => {
                format!("the disk was too slow: a frame was dropped before frame {n}")
            }
            Self::Unusable => format!(
                "a frame before frame {n} could not be recorded: it was empty, or no key frame came before it"
            ),
            Self::Damaged(fault) => format!("frame {n} is damaged: {fault}"),
        }
    }
}

/// What the camera's thread leaves.
pub(super) struct CameraOutcome {
    pub(super) end: End,
    pub(super) count: TurnCount,
    /// By index among the delivered frames of the turn.
    pub(super) issues: Vec<(usize, FrameIssue)>,
}

/// What the writer's thread leaves.
pub(super) struct WriterOutcome {
    pub(super) session: SessionWriter,
    /// For each frame of the video its index among the delivered frames of the turn; `None` before
    /// the turn.
    pub(super) delivered: Vec<Option<usize>>,
    /// Delivered frames that were left out, as no key frame came before them.
    pub(super) left_out: Vec<usize>,
    /// Bytes of video.
    pub(super) bytes: u64,
    /// What the disk refused.
    pub(super) failure: Option<RecordingError>,
}
