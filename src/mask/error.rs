//! What can go wrong between an image with hints and its mask.

use std::io;
use std::path::PathBuf;

use super::{Feather, Iterations, MAX_PIXELS, MIN_SIDE};
use relit_data::geometry::Rect;

/// Why there is no mask.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A side of the frame is under [`MIN_SIDE`].
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
    /// Nothing of the rectangle lies in the frame.
    #[error(
        "the rectangle {rect} lies outside the frame of {width} x {height} pixels: give one that holds the object"
    )]
    RectOutside {
        /// The rectangle as given.
        rect: Rect,
        /// The frame's width, pixels.
        width: u32,
        /// The frame's height, pixels.
        height: u32,
    },
    /// No pixel is left from which to learn the background.
    #[error(
        "the hints leave no background in the frame of {width} x {height} pixels: draw the rectangle smaller than the frame, or mark background black in the seeds"
    )]
    NoBackground {
        /// The frame's width, pixels.
        width: u32,
        /// The frame's height, pixels.
        height: u32,
    },
    /// The seeds mark background everywhere in the rectangle, and no object.
    #[error(
        "the seeds leave no pixel of the rectangle {rect} that could be the object: mark some of the object white"
    )]
    NoObject {
        /// The rectangle as given.
        rect: Rect,
    },
    /// Neither rectangle nor seeds.
    #[error("nothing says where the object is: give a rectangle, seeds, or both")]
    NoHints,
    /// Seeds alone that mark no object.
    #[error(
        "the seeds mark no pixel as the object and there is no rectangle: paint white on the object, or give --rect too"
    )]
    NothingMarked,
    /// The seeds have another size than the frame.
    #[error(
        "the seeds are {} x {} pixels and the frame is {} x {}: paint them on an image of the frame's size", .seeds.0, .seeds.1, .frame.0, .frame.1
    )]
    SeedsSize {
        /// Width and height of the seeds, pixels.
        seeds: (u32, u32),
        /// Width and height of the frame, pixels.
        frame: (u32, u32),
    },
    /// A seeds image that is of no use.
    #[error("the seeds {path} cannot be used: {fault}")]
    Seeds {
        /// The image.
        path: PathBuf,
        /// What is wrong with it.
        fault: SeedsFault,
    },
    /// A number of iterations out of range.
    #[error("{0} iterations are out of range: give 1 to {most}", most = Iterations::MOST)]
    Iterations(u32),
    /// A feather out of range.
    #[error("a feather of {0} pixels is out of range: give 0 to {most}", most = Feather::MOST)]
    Feather(u32),
    /// GrabCut took every pixel for background.
    #[error(
        "nothing was left as the object: it does not differ enough from its background for this hint; draw the rectangle closer, or mark the object white in seeds"
    )]
    Empty,
    /// GrabCut took every pixel for object.
    #[error(
        "the whole frame was taken for the object: mark background black in the seeds, or give a rectangle"
    )]
    Everything,
    /// OpenCV refused.
    #[error("OpenCV failed while {doing}")]
    OpenCv {
        /// What was being done: "cutting".
        doing: &'static str,
        /// OpenCV's word.
        source: opencv::Error,
    },
    /// A picture could not be turned into PNG.
    #[error("{what} could not be encoded as PNG")]
    Encode {
        /// What was encoded: "the mask".
        what: &'static str,
        /// The encoder's word.
        source: image::ImageError,
    },
    /// The file system refused.
    #[error("{path} could not be {doing}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What was to be done, as a participle: "read".
        doing: &'static str,
        /// The system's answer.
        source: io::Error,
    },
}

impl Error {
    pub(super) fn io(
        path: impl Into<PathBuf>,
        doing: &'static str,
    ) -> impl FnOnce(io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io {
            path,
            doing,
            source,
        }
    }

    pub(super) fn opencv(doing: &'static str) -> impl FnOnce(opencv::Error) -> Self {
        move |source| Self::OpenCv { doing, source }
    }
}

/// Why an image cannot serve as seeds.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SeedsFault {
    /// Not a PNG; a lossy format would smear the marks.
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
    /// A recorded seeds image holds a level that stands for nothing.
    #[error("it holds grey level {0}, where only 0, 128 and 255 stand for something")]
    Level(u8),
}
