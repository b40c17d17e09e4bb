//! A segmentation network that somebody brings as an ONNX file: where the object is, as marks from which GrabCut cuts it
//! out at full resolution.
//!
//! What a file takes says which kind it is ([`kind`]): a network that answers one picture with a map of the object, or
//! one that is asked with a box or points, in one file or in two, an encoder and its decoder. The frame becomes the
//! network's input ([`picture`]), its answer a map of how sure the object is ([`answer`]), and the map marks: surely
//! object, surely background, and a band between them that GrabCut decides ([`marks`]). `engine` alone knows tract.
//!
//! Without the feature `networks` there is none, and [`Network::open`] says so; what a record says of one is read all
//! the same.

#[cfg(feature = "networks")]
mod answer;
#[cfg(feature = "networks")]
mod engine;
#[cfg(feature = "networks")]
mod guard;
#[cfg(feature = "networks")]
mod kind;
#[cfg(feature = "networks")]
mod marks;
#[cfg(not(feature = "networks"))]
mod none;
#[cfg(feature = "networks")]
mod opened;
#[cfg(feature = "networks")]
mod picture;
#[cfg(feature = "networks")]
mod prompt;
mod recorded;

#[cfg(not(feature = "networks"))]
pub(super) use none::Network;
#[cfg(feature = "networks")]
pub(super) use opened::Network;
pub use recorded::{NetworkFile, RecordedNetwork};
