//! Errors of weights and inference.

use std::io;
use std::path::PathBuf;

/// Why weights could not be read, written or used.
#[derive(Debug, thiserror::Error)]
pub enum NetError {
    /// Weights of another network, or that do not fit into it or a file.
    #[error("{0}")]
    Weights(String),
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
    /// A file that holds no weights, no network or no library that can be used.
    #[error("{path} cannot be used: {fault}", path = .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The fault.
        fault: String,
    },
    /// A network that cannot be run, or cannot take such a picture.
    #[error("{0}")]
    Run(String),
}

impl NetError {
    /// Weights lack a parameter.
    pub fn missing(net: &str, name: &str) -> Self {
        Self::Weights(format!(
            "the weights have no {name}, which {net} needs: are they another network's?"
        ))
    }
}
