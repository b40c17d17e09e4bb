//! The errors of making a mask.

use relit_data::geometry::Rect;

use super::settings::{MAX_PIXELS, MIN_SIDE};

/// Why no mask could be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MaskError {
    /// A side of the frame is shorter than [`MIN_SIDE`].
    #[error(
        "the frame is {width} x {height} pixels, too small to segment: at least {MIN_SIDE} a side are needed"
    )]
    FrameTooSmall {
        /// The frame's width, pixels.
        width: u32,
        /// The frame's height, pixels.
        height: u32,
    },
    /// The frame has more than [`MAX_PIXELS`].
    #[error(
        "the frame is {width} x {height} pixels, more than the {MAX_PIXELS} that can be segmented: scale the video down"
    )]
    FrameTooLarge {
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
        "the hints leave no background in the frame of {width} x {height} pixels: draw the rectangle smaller than the frame, or mark background black in the seeds"
    )]
    NoBackground {
        /// The frame's width, pixels.
        width: u32,
        /// The frame's height, pixels.
        height: u32,
    },
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
    /// There are neither a rectangle nor seeds.
    #[error("there is no hint where the object is: give a rectangle, seeds, or both")]
    NoHints,
    /// There is no rectangle, and the seeds mark no object.
    #[error(
        "the seeds mark no pixel as the object and there is no rectangle: paint white on the object, or give --rect too"
    )]
    NothingMarked,
    /// Seeds and frame differ in size.
    #[error(
        "the seeds are {} x {} pixels and the frame is {} x {}: paint them on an image of the frame's size", .seeds.0, .seeds.1, .frame.0, .frame.1
    )]
    SeedsSize {
        /// Width and height of the seeds, pixels.
        seeds: (u32, u32),
        /// Width and height of the frame, pixels.
        frame: (u32, u32),
    },
    /// Strokes that cannot be painted.
    #[error(transparent)]
    Strokes(#[from] StrokesFault),
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
    /// An image could not be encoded as PNG.
    #[error("{what} could not be encoded as PNG")]
    Encode {
        /// The image, as in "the mask".
        what: &'static str,
        /// The encoder's error.
        source: image::ImageError,
    },
}

/// Why an image cannot be used as seeds.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SeedsFault {
    /// Not a PNG. A lossy format would blur the marks.
    #[error("it is not a PNG file; save the seeds as PNG")]
    NotPng,
    /// A PNG that cannot be decoded.
    #[error("it cannot be decoded as PNG ({0}); save it again")]
    Damaged(image::ImageError),
    /// No pixel marks anything.
    #[error(
        "no pixel of it is white (object) or black (background): paint with a hard brush, nearly white is unknown"
    )]
    WithoutMark,
    /// A recorded seeds image has an invalid grey level.
    #[error("it has the grey level {0}, but only 0, 128 and 255 are valid")]
    Level(u8),
}

/// Why strokes cannot be painted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StrokesFault {
    /// No point.
    #[error("stroke {0} has no point")]
    Empty(usize),
    /// A number that is no length, or too large.
    #[error("stroke {0} has a coordinate or radius that is out of range")]
    OutOfRange(usize),
    /// Painting would take too long.
    #[error("the strokes cover too many pixels: paint with fewer or smaller ones")]
    TooLarge,
}
