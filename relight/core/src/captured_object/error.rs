//! Why a captured object cannot be read or written.

#[cfg(feature = "files")]
use std::error::Error;
#[cfg(feature = "files")]
use std::path::Path;
use std::path::PathBuf;

#[cfg(feature = "files")]
use relit_data::causes::with_causes;

use crate::image::ImageError;

/// Why a captured object cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum CapturedObjectError {
    /// The file cannot be read or written, or is not a captured object.
    #[error("{} {fault}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The fault.
        fault: String,
    },
    /// Its content cannot be used.
    #[error("{0}")]
    Content(String),
    /// Maps do not fit together.
    #[error(transparent)]
    Image(#[from] ImageError),
}

impl CapturedObjectError {
    /// For a closure that knows why something cannot be done with a file.
    #[cfg(feature = "files")]
    pub(crate) fn file<E: Error + 'static>(path: &Path, what: &'static str) -> impl Fn(E) -> Self {
        let path = path.to_owned();
        move |error| Self::File {
            path: path.clone(),
            fault: format!("{what}: {}", with_causes(&error)),
        }
    }

    /// For a closure that knows why an entry is of no use.
    pub(super) fn entry<E: ToString>(entry: &'static str) -> impl Fn(E) -> Self {
        move |reason| {
            let reason = reason.to_string();
            Self::Content(format!("its entry {entry} is missing or damaged: {reason}"))
        }
    }
}

impl From<zip::result::ZipError> for CapturedObjectError {
    fn from(fault: zip::result::ZipError) -> Self {
        Self::Content(format!("it is not a ZIP archive, or is damaged: {fault}"))
    }
}
