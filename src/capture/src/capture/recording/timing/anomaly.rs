//! What does not fit in a camera's counter and time stamps, though no frame need be missing.

/// An inconsistency in a stream's counter or time stamps.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub(crate) enum TimingAnomaly {
    /// Counter and time stamps disagree on what lies between two frames.
    #[error(
        "before frame {before} the driver's counter grows by {counted} frames, but the time stamps by {timed}"
    )]
    Contradiction {
        /// The frame after the place.
        before: usize,
        /// By how much the counter grew.
        counted: i64,
        /// By how many periods the time grew.
        timed: i64,
    },
    /// A stamp that is off by a period or more, while its neighbours are not.
    #[error("the time stamp of frame {frame} is off by {off} frames")]
    OddTime {
        /// The frame.
        frame: usize,
        /// By how many periods; positive where it is late.
        off: i64,
    },
    /// Two frames in one period, without a counter that distinguishes them.
    #[error("frame {frame} comes within the same period as the one before")]
    SamePeriod {
        /// The second of both.
        frame: usize,
    },
    /// Frames cannot be counted by their time stamps.
    #[error("the time stamps are too irregular to count frames by")]
    Irregular,
    /// The camera does not keep the agreed rate.
    #[error("the camera delivers {measured:.2} frames/s, but {agreed:.2} were agreed")]
    Rate {
        /// Frames a second as measured.
        measured: f64,
        /// Frames a second as agreed.
        agreed: f64,
    },
}

impl TimingAnomaly {
    /// The same with frames counted from frame `first` on; `None` if it is about a frame before
    /// that one, or about one of `frames` frames later or more.
    pub(crate) fn counted_from(mut self, first: usize, frames: usize) -> Option<Self> {
        match &mut self {
            Self::Contradiction { before: at, .. }
            | Self::OddTime { frame: at, .. }
            | Self::SamePeriod { frame: at } => {
                *at = at.checked_sub(first).filter(|&at| at < frames)?;
            }
            Self::Irregular | Self::Rate { .. } => {}
        }
        Some(self)
    }
}
