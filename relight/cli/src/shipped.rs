//! The built-in weights.

use relight_photo::nets::{NetError, Weights};

/// The weights of the decomposing network.
///
/// # Errors
/// If the program was built with a damaged file.
pub(crate) fn weights() -> Result<Weights, NetError> {
    let bytes = include_bytes!("../weights/decompose.safetensors");
    read("relight/cli/weights/decompose.safetensors", bytes)
}

/// The weights of the network of turns.
///
/// # Errors
/// As [`weights`].
pub(crate) fn turn_weights() -> Result<Weights, NetError> {
    let bytes = include_bytes!("../weights/turn.safetensors");
    read("relight/cli/weights/turn.safetensors", bytes)
}

/// Weights by their path in the repository.
fn read(path: &str, bytes: &[u8]) -> Result<Weights, NetError> {
    Weights::from_bytes(bytes).map_err(|fault| NetError::file(path.as_ref(), fault))
}
