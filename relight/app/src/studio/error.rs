//! What can be wrong with a request, each as a sentence for the person at the page.

use relight_core::captured_object::CapturedObjectError;
use relight_core::image::ImageError;
use relight_core::light::LightError;
use relight_photo::decompose::DecomposeError;
use relight_photo::insert::{InsertError, SceneFault};
use relit_grabcut::{MaskError, StrokesFault};
use zip::result::ZipError;

use crate::message::MessageFault;

/// Why a request cannot be answered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudioError {
    /// The message is none.
    #[error(transparent)]
    Message(#[from] MessageFault),
    /// Its JSON is none that is known.
    #[error("the engine does not know this request")]
    Request(#[source] serde_json::Error),
    /// A part is missing.
    #[error("the request has no {0}")]
    Part(&'static str),
    /// The answer cannot be told.
    #[error("the answer cannot be told")]
    Answer(#[source] serde_json::Error),
    /// The weights were not loaded.
    #[error("the networks are not loaded yet: wait a moment")]
    NoNetwork,
    /// There is no such object.
    #[error("there is no object {0}: open its photograph again")]
    NoObject(u32),
    /// There are too many.
    #[error("there are {0} objects already, and a scene has at most that many: remove one first")]
    ManyObjects(usize),
    /// The object of a photograph was not marked.
    #[error("{name}: mark the object first, by a rectangle or strokes")]
    NoMask {
        /// The photograph's name.
        name: String,
    },
    /// A captured object has a mask of its own.
    #[error("{name} is a captured object: it has its own mask")]
    Captured {
        /// The file's name.
        name: String,
    },
    /// A photograph has too many pixels.
    #[error("{name} has {width} x {height} pixels: at most {} million are read", most / 1_000_000)]
    TooLarge {
        /// The photograph's name.
        name: String,
        /// Its width.
        width: usize,
        /// Its height.
        height: usize,
        /// What is read.
        most: usize,
    },
    /// There is no background yet.
    #[error("choose a scene first")]
    NoBackground,
    /// There is no panorama of this name.
    #[error("there is no panorama {0}")]
    NoPanorama(String),
    /// A panorama has another shape.
    #[error("{name} has {width} x {height} pixels: a panorama is twice as wide as high")]
    PanoramaShape {
        /// The file's name.
        name: String,
        /// Its width.
        width: usize,
        /// Its height.
        height: usize,
    },
    /// A photograph of a background has values that are no light.
    #[error("{name} has a value that is negative, infinite or not a number")]
    NotLight {
        /// The file's name.
        name: String,
    },
    /// There is nothing to keep.
    #[error("the scene has no objects yet")]
    Empty,
    /// An archive is no scene.
    #[error("{name} is not in the archive, and its scene.toml names it")]
    NotInArchive {
        /// The entry.
        name: String,
    },
    /// An archive holds too much.
    #[error("the archive is too large: it holds more than {0} MB")]
    ArchiveTooLarge(u64),
    /// A scene needs what the page has not.
    #[error("the page cannot open scenes with {0}: relight insert can")]
    Unsupported(&'static str),
    /// Its `scene.toml` is no text.
    #[error("scene.toml is no text")]
    NoText,
    /// The archive cannot be read or written.
    #[error("the file is no scene that was kept: it is no ZIP archive, or damaged")]
    Archive(#[from] ZipError),
    /// The archive cannot be read or written.
    #[error("the archive is damaged")]
    Bytes(#[from] std::io::Error),
    /// A picture cannot be read or written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// Light cannot be used.
    #[error(transparent)]
    Light(#[from] LightError),
    /// A captured object cannot be read.
    #[error(transparent)]
    CapturedObject(#[from] CapturedObjectError),
    /// A photograph cannot be decomposed.
    #[error(transparent)]
    Decompose(#[from] DecomposeError),
    /// An object cannot be inserted.
    #[error(transparent)]
    Insert(#[from] InsertError),
    /// A mask cannot be made.
    #[error(transparent)]
    Mask(#[from] MaskError),
    /// Strokes are none.
    #[error(transparent)]
    Strokes(#[from] StrokesFault),
    /// A scene cannot be.
    #[error(transparent)]
    Scene(#[from] SceneFault),
    /// The weights are none.
    #[error("the weights of the networks are damaged: {0}")]
    Weights(String),
}
