//! What can go wrong while training.

use crate::nets;

/// Why training could not begin or go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TrainError {
    /// libtorch refused.
    #[error("libtorch failed")]
    Torch(#[from] tch::TchError),
    /// Weights do not fit, or cannot be read or written.
    #[error(transparent)]
    Weights(#[from] nets::NetError),
    /// An optimiser's memory that is another network's.
    #[error("the saved optimiser has no {0} of the right shape: it is another network's")]
    Memory(String),
}
