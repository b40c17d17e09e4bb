//! What a recording's owner and its two threads share: wishes one way, such as the time of the turn, figures the
//! other.

use relit_data::clock::Waitable;

/// How far a recording has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Progress {
    /// Frames in the video.
    pub frames: u64,
    /// Frames that were dropped because the disk was too slow.
    pub overrun: u64,
    /// True once nothing more is recorded: [`super::Recorder::wait`] returns soon.
    pub ended: bool,
}

/// What the owner wants, and how far the threads are.
#[derive(Debug, Default)]
pub(super) struct State {
    /// When the turn is, once that is known.
    pub(super) window: Option<Window>,
    /// Whether the recording is to stop.
    pub(super) stop: bool,
    pub(super) progress: Progress,
}

/// Locked for moments only: the camera's thread looks at it between two frames.
pub(super) type Shared = Waitable<State>;

/// From the first instant of a turn up to, but not with, the last; microseconds of the clock that
/// stamps the frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    pub(super) from_us: i64,
    /// When it is over.
    pub to_us: i64,
}

impl Window {
    /// A window of `us` microseconds, at least one, from `from_us` on.
    pub fn lasting(from_us: i64, us: i64) -> Self {
        let from_us = from_us.min(i64::MAX - 1);
        Self {
            from_us,
            to_us: from_us.saturating_add(us.max(1)),
        }
    }
}
