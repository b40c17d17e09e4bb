//! The weights that come with the program.

use relight_nets::{NetError, Weights};
use relight_photo::decompose::{DecomposeError, Decomposer};

/// Where they stand in the repository.
const NAME: &str = "relight/cli/weights/decompose.safetensors";
const BYTES: &[u8] = include_bytes!("../weights/decompose.safetensors");

/// The weights of the decomposing network.
///
/// # Errors
/// [`NetError::File`] where the program was built with a damaged file.
pub(crate) fn weights() -> Result<Weights, NetError> {
    Weights::from_bytes(BYTES).map_err(|fault| NetError::File {
        path: NAME.into(),
        fault,
    })
}

/// Where the weights of the network of turns stand in the repository.
const TURN_NAME: &str = "relight/cli/weights/turn.safetensors";
const TURN_BYTES: &[u8] = include_bytes!("../weights/turn.safetensors");

/// The weights of the network of turns.
///
/// # Errors
/// [`NetError::File`] where the program was built with a damaged file.
pub(crate) fn turn_weights() -> Result<Weights, NetError> {
    Weights::from_bytes(TURN_BYTES).map_err(|fault| NetError::File {
        path: TURN_NAME.into(),
        fault,
    })
}

/// The decomposing network with these weights.
///
/// # Errors
/// As [`weights`].
pub(crate) fn decomposer() -> Result<Decomposer, DecomposeError> {
    Decomposer::new(&weights()?)
}
