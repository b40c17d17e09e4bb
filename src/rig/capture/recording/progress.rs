//! What a recording's owner and its two threads share: wishes one way, figures the other.

use super::window::Window;
use crate::clock::Waitable;

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
