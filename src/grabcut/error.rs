//! The errors of making a mask.

use relit_data::geometry::Rect;

use super::settings::{MAX_PIXELS, MIN_SIDE};

/// Why no mask could be made.
#[derive(Debug, thiserror::Error)]
pub enum MaskError {
    /// A side of the frame is shorter than [`MIN_SIDE`], or it has more than [`MAX_PIXELS`].
    #[error(
        "a frame of {width} x {height} pixels cannot be segmented: it needs at least {MIN_SIDE} a side and at most {MAX_PIXELS} in all"
    )]
    FrameSize {
        /// The frame's width, pixels.
        width: u32,
        /// The frame's height, pixels.
        height: u32,
    },
    /// The rectangle is outside the frame.
    #[error(
        "the rectangle {rect} is outside the frame of {width} x {height} pixels: give one that contains the object"
    )]
    RectOutside {
        /// The rectangle as given.
        rect: Rect,
        /// The frame's width, pixels.
        width: u32,
        /// The frame's height, pixels.
        height: u32,
    },
    /// No pixel could be background.
    #[error(
        "the hints leave no background in the frame: draw the rectangle smaller than the frame, or mark background black in the seeds"
    )]
    NoBackground,
    /// The seeds mark the whole rectangle as background.
    #[error(
        "the seeds leave no pixel of the rectangle {rect} that could be the object: mark some of the object white"
    )]
    NoObject {
        /// The rectangle as given.
        rect: Rect,
    },
    /// A turn with too few frames.
    #[error(
        "the video has only {found} usable frame(s), too few to see what moves: give a rectangle or seeds"
    )]
    FewFrames {
        /// Number of frames.
        found: usize,
    },
    /// There is no rectangle, and no seeds that mark the object.
    #[error(
        "no hint says where the object is: give a rectangle, or seeds with some of the object painted white"
    )]
    NoHints,
    /// Seeds, or a mask that is checked, and frame differ in size.
    #[error(
        "the seeds are {} x {} pixels and the frame is {} x {}: paint them on an image of the frame's size", .seeds.0, .seeds.1, .frame.0, .frame.1
    )]
    SeedsSize {
        /// Width and height of the seeds, pixels.
        seeds: (u32, u32),
        /// Width and height of the frame, pixels.
        frame: (u32, u32),
    },
    /// An image that cannot be used as seeds: what is wrong with it.
    #[error("{0}")]
    Seeds(String),
    /// The stroke of this number, from 0, cannot be painted.
    #[error("stroke {0} has no point, or a coordinate or radius that is out of range")]
    Stroke(usize),
    /// Painting would take too long.
    #[error("the strokes cover too many pixels: paint with fewer or smaller ones")]
    StrokesTooLarge,
    /// GrabCut classified every pixel as background.
    #[error(
        "no object was found: it does not differ enough from its background for this hint; draw the rectangle closer, or mark the object white in seeds"
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
