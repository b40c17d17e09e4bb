//! What can be wrong with an export.

use std::io;
use std::path::PathBuf;

use relight_core::captured_object::CapturedObjectError;
use relight_core::image::ImageError;
use relight_reader::{DamagedSample, OpenError};

/// Why something is not exported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The input is nothing that holds an object.
    #[error("{} holds no object: give object.relit, or a folder that relight turn or relight decompose has written", path.display())]
    NoObject {
        /// The input.
        path: PathBuf,
    },
    /// A file of figures cannot be read.
    #[error("{} cannot be read: {reason}", path.display())]
    Figures {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The object covers no pixel.
    #[error("the object covers no pixel by half or more: there is nothing to export")]
    Empty,
    /// The file would be larger than its format allows.
    #[error("the file would have {bytes} bytes, more than the 4 GiB of a GLB")]
    TooLarge {
        /// Its size.
        bytes: u64,
    },
    /// A map cannot be encoded.
    #[error("the map {map} cannot be encoded: {reason}")]
    Encode {
        /// The map.
        map: &'static str,
        /// What the encoder answers.
        reason: String,
    },
    /// A file cannot be written.
    #[error("{} cannot be written", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system answers.
        source: io::Error,
    },
    /// Something else is where the results should be.
    #[error("{} holds {name}, which is no exported frame: give a folder that is new or empty", path.display())]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// What is in it.
        name: String,
    },
    /// The input holds another number of turns than one.
    #[error("{} holds {turns} turns: give the shard of one", path.display())]
    Turns {
        /// The input.
        path: PathBuf,
        /// How many it holds.
        turns: usize,
    },
    /// A frame is damaged.
    #[error("a frame is damaged: {0}")]
    Damaged(DamagedSample),
    /// A turn whose frames have no angles.
    #[error(
        "frame {key} has no angle: a list of light positions needs a turn that was recorded with the table"
    )]
    NoAngle {
        /// The frame.
        key: String,
    },
    /// No single lamp lights the turn.
    #[error(
        "no lamp dominates: the light has {found:.2} of a single lamp's direction, and {needed:.2} are needed; leave out --lamps"
    )]
    NoLamp {
        /// The part that was found.
        found: f64,
        /// The part that is needed.
        needed: f64,
    },
    /// A picture.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A captured object.
    #[error(transparent)]
    Object(#[from] CapturedObjectError),
    /// A turn.
    #[error(transparent)]
    Open(#[from] OpenError),
}
