//! What can be wrong with a take, frame by frame and as a whole.

use relit_data::counts::count_of;

use super::timing::{MissingFrames, TimingAnomaly};
use relit_camera::FrameFault;

/// Something wrong with a take. Frames are given by their index among the delivered frames of the
/// turn.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Finding {
    /// Frames were exposed and not delivered.
    Missing(MissingFrames),
    /// A frame was dropped, as the disk was too slow.
    QueueFull(usize),
    /// A frame could not be recorded: it was empty, or no key frame came before it.
    Unusable(usize),
    /// Frames from this one on did not reach the disk, which had refused.
    Unwritten {
        /// The first of them.
        from: usize,
        /// How many of the turn's delivered frames they are.
        count: u64,
    },
    /// A frame was damaged, and recorded as it came.
    Damaged(usize, FrameFault),
    /// Counter and time stamps do not fit.
    Anomaly(TimingAnomaly),
    /// The camera's settings have changed.
    Settings(String),
}

impl Finding {
    /// A number for its kind, in the order in which kinds are listed, and the frame that it is
    /// about, or that comes next.
    pub(super) fn place(&self) -> (u8, Option<usize>) {
        match self {
            Self::Missing(missing) => (0, Some(missing.before)),
            Self::QueueFull(at) => (1, Some(*at)),
            Self::Unusable(at) => (2, Some(*at)),
            Self::Unwritten { from, .. } => (3, Some(*from)),
            Self::Damaged(at, _) => (4, Some(*at)),
            Self::Anomaly(_) => (5, None),
            Self::Settings(_) => (6, None),
        }
    }

    /// How many frames are not in the video because of it.
    pub(super) fn lost(&self) -> u64 {
        match self {
            Self::Missing(missing) => missing.count,
            Self::Unwritten { count, .. } => *count,
            Self::QueueFull(_) | Self::Unusable(_) => 1,
            Self::Damaged(..) | Self::Anomaly(_) | Self::Settings(_) => 0,
        }
    }

    /// In words; `n`: the frame of the video that it is about, or that comes next.
    pub(super) fn text(&self, n: usize) -> String {
        match self {
            Self::Missing(missing) => {
                format!(
                    "{} missing before frame {n}",
                    count_of(missing.count, "frame")
                )
            }
            Self::QueueFull(_) => {
                format!("the disk was too slow: a frame was dropped before frame {n}")
            }
            Self::Unusable(_) => format!(
                "a frame before frame {n} could not be recorded: it was empty, or no key frame came before it"
            ),
            Self::Unwritten { count, .. } => format!(
                "the disk accepted no more data: {} from frame {n} on are missing",
                count_of(*count, "frame")
            ),
            Self::Damaged(_, fault) => format!("frame {n} is damaged: {fault}"),
            Self::Anomaly(anomaly) => anomaly.to_string(),
            Self::Settings(what) => what.clone(),
        }
    }
}
