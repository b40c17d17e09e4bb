//! Errors of weights and inference.

use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};

/// Why weights could not be read, written or used.
#[derive(Debug, thiserror::Error)]
pub enum NetError {
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
    /// Any other fault, as a sentence.
    #[error("{0}")]
    Other(String),
}

impl NetError {
    /// A file holds no weights that can be used.
    pub fn file(path: &Path, fault: impl Display) -> Self {
        Self::Other(format!("{} cannot be used: {fault}", path.display()))
    }

    /// Weights lack a parameter.
    pub fn missing(net: &str, name: &str) -> Self {
        Self::Other(format!(
            "the weights have no {name}, which {net} needs: are they another network's?"
        ))
    }
}
