//! The errors of the check itself.

use std::io;
use std::path::PathBuf;

/// Why the structure could not be checked.
#[derive(Debug, thiserror::Error)]
pub(crate) enum HouseError {
    /// A file could not be read.
    #[error("{path} cannot be read: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// A source file is not Rust as the check's parser knows it.
    #[error("{path}:{line} cannot be parsed: {source}")]
    Syntax {
        /// The file.
        path: PathBuf,
        /// The line.
        line: usize,
        /// What is wrong.
        source: syn::Error,
    },
    /// A module is declared and has no file.
    #[error("{declared_in} declares the module `{module}`, which has no file")]
    NoModuleFile {
        /// The file of the declaration.
        declared_in: PathBuf,
        /// The module.
        module: String,
    },
    /// Cargo could not be started.
    #[error("cargo cannot be started: {0}")]
    StartCargo(io::Error),
    /// Cargo does not accept a manifest.
    #[error("`cargo metadata` fails for {manifest}: {message}")]
    Metadata {
        /// The manifest.
        manifest: PathBuf,
        /// What cargo says.
        message: String,
    },
    /// Cargo's answer is not understood.
    #[error("the answer of `cargo metadata` for {manifest} is not understood: {source}")]
    MetadataFormat {
        /// The manifest.
        manifest: PathBuf,
        /// What is wrong.
        source: serde_json::Error,
    },
    /// The workspace's manifest is not TOML.
    #[error("{path} is not understood: {source}")]
    Manifest {
        /// The manifest.
        path: PathBuf,
        /// What is wrong.
        source: Box<toml::de::Error>,
    },
    /// Standard output is closed.
    #[error("the findings cannot be printed: {0}")]
    Print(io::Error),
}
