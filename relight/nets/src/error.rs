//! What can go wrong with weights and inference.

use std::io;
use std::path::PathBuf;

/// Why weights could not be read, written or used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NetError {
    /// A parameter is not there.
    #[error("the weights have no {name}, which {net} needs: are they another network's?")]
    Missing {
        /// The network.
        net: &'static str,
        /// The parameter.
        name: String,
    },
    /// A parameter of another shape.
    #[error(
        "{name} is of shape {found:?} where {net} needs {expected:?}: are they another network's weights?"
    )]
    Shape {
        /// The network.
        net: &'static str,
        /// The parameter.
        name: String,
        /// The shape in the file.
        found: Vec<usize>,
        /// The shape that is needed.
        expected: Vec<usize>,
    },
    /// A tensor that the network does not have.
    #[error("the weights hold {name}, which {net} does not have: are they another network's?")]
    Unknown {
        /// The network.
        net: &'static str,
        /// The tensor.
        name: String,
    },
    /// A weight that is no number.
    #[error("{name} holds a value that is not a finite number: the training that made it failed")]
    NotFinite {
        /// The parameter.
        name: String,
    },
    /// A weight that half precision cannot hold.
    #[error("{name} holds {value}, and half precision ends at 65504: write it in single precision")]
    TooLarge {
        /// The parameter.
        name: String,
        /// Its value.
        value: f32,
    },
    /// A file that cannot be read or written.
    #[error("{path} could not be {doing}", path = .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried, as a participle: "read".
        doing: &'static str,
        /// The system's reason.
        source: io::Error,
    },
    /// A file that holds no weights.
    #[error("{path} cannot be used as weights: {fault}", path = .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        fault: String,
    },
    /// An ONNX file that cannot be run.
    #[error("{path} cannot be run: {fault}", path = .path.display())]
    Onnx {
        /// The file.
        path: PathBuf,
        /// The engine's own words.
        fault: String,
    },
    /// A picture of a size that the network cannot take.
    #[error("{net} cannot take a picture of {width} x {height} pixels: {needs}")]
    PictureSize {
        /// The network.
        net: &'static str,
        /// The picture's width, pixels.
        width: usize,
        /// The picture's height, pixels.
        height: usize,
        /// What it needs.
        needs: String,
    },
    /// A library of an engine that is not installed.
    #[error(
        "there is no ONNX Runtime at {path}: install it and set ORT_DYLIB_PATH to its library, or use --engine tract",
        path = .path.display()
    )]
    NoLibrary {
        /// Where it should be.
        path: PathBuf,
    },
    /// A library of an engine that is there and cannot be used.
    #[error(
        "{path} cannot be used as ONNX Runtime: {fault}; set ORT_DYLIB_PATH to the library of version 1.17 or later, or use --engine tract",
        path = .path.display()
    )]
    Library {
        /// The library.
        path: PathBuf,
        /// What is wrong with it.
        fault: String,
    },
    /// The inference engine failed.
    #[error("{engine} could not {doing} {net}: {fault}")]
    Engine {
        /// The engine.
        engine: &'static str,
        /// What was tried, as a verb: "run".
        doing: &'static str,
        /// The network.
        net: &'static str,
        /// The engine's own words.
        fault: String,
    },
}
