//! The errors of making a mask.

use super::settings::{MAX_PIXELS, MIN_SIDE};

/// Why no mask could be made.
#[derive(Debug, thiserror::Error)]
pub enum MaskError {
    /// A side of the frame is shorter than [`MIN_SIDE`], or it has more than [`MAX_PIXELS`].
    #[error(
        "a frame of {width} x {height} pixels cannot be segmented: it needs at least {MIN_SIDE} a side and at most {MAX_PIXELS} in total"
    )]
    FrameSize {
        /// The frame's width, pixels.
        width: u32,
        /// The frame's height, pixels.
        height: u32,
    },
    /// Hints that do not fit the frame, or cannot be used: what is wrong with them, and what to give.
    #[error("{0}")]
    Hints(String),
    /// A turn with too few frames.
    #[error(
        "the video has only {found} usable frame(s), too few to see what moves: give a rectangle or seeds"
    )]
    FewFrames {
        /// Number of frames.
        found: usize,
    },
    /// The background does not show where the object is.
    #[error(
        "the object cannot be found by its background ({why}): give a rectangle around the object, --rect X,Y,W,H"
    )]
    NotPlain {
        /// What is not plain about it, of "it", the background.
        why: &'static str,
    },
    /// GrabCut classified every pixel as background.
    #[error(
        "no object was found: it differs too little from its background; draw the rectangle closer, or mark the object white in seeds"
    )]
    Empty,
    /// GrabCut classified every pixel as object.
    #[error(
        "the whole frame was classified as the object: mark background black in the seeds, or give a rectangle"
    )]
    Everything,
    /// An image could not be encoded.
    #[error("{what} could not be encoded")]
    Encode {
        /// The image, as in "the mask".
        what: &'static str,
        /// The encoder's error.
        source: image::ImageError,
    },
}

impl MaskError {
    /// That seeds, or a mask that is checked, have another size than the frame.
    pub(super) fn sizes(seeds: (u32, u32), frame: (u32, u32)) -> Self {
        Self::Hints(format!(
            "the seeds are {} x {} pixels and the frame is {} x {}: paint them on an image of the frame's size",
            seeds.0, seeds.1, frame.0, frame.1
        ))
    }
}
