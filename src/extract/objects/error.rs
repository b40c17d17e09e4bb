//! The errors of object stores.

use std::io;
#[cfg(feature = "object-store")]
use std::path::Path;
use std::path::PathBuf;

/// Why something could not be read from or written to an object store. No message holds credentials.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ObjectError {
    /// This build has no object stores.
    #[error(
        "{0} is a URL, and this program was built without object stores: build it with `--features object-store`, or give a folder"
    )]
    NotBuilt(String),
    /// A URL with credentials.
    #[error("{0} is given with credentials or a query: they belong into the environment")]
    Credentials(String),
    /// A command that reads folders only.
    #[error(
        "{0} is a URL, and this command reads a folder: copy the data set to the local disk first"
    )]
    FolderOnly(String),
    /// Not a URL of an object store.
    #[error(
        "{url} is no object store: {why}; give s3://BUCKET/PATH, gs://BUCKET/PATH, az://CONTAINER/PATH or file:///PATH"
    )]
    Url {
        /// The URL, without credentials.
        url: String,
        /// What is wrong with it.
        why: String,
    },
    /// A bucket or object that does not exist.
    #[error("{0} is not there: check the name of the bucket and the path")]
    NotThere(String),
    /// The store refuses.
    #[error(
        "{url} may not be {doing}: check the credentials in the environment and what they allow"
    )]
    Forbidden {
        /// The URL.
        url: String,
        /// What was attempted.
        doing: &'static str,
    },
    /// The store could not be reached, or failed.
    #[error(
        "{url} could not be {doing}: {why}; what was finished is there, run again with --resume"
    )]
    Failed {
        /// The URL.
        url: String,
        /// What was attempted.
        doing: &'static str,
        /// The reason, as the system or the store gives it.
        why: String,
    },
    /// A file on the local disk, which a recording passes through.
    #[error("{path} on the local disk, through which object stores are read and written, could not be {doing}; --cache takes another folder", path = .path.display())]
    Local {
        /// The file or folder.
        path: PathBuf,
        /// What was attempted.
        doing: &'static str,
        /// The system's error.
        source: io::Error,
    },
}

#[cfg(feature = "object-store")]
impl ObjectError {
    pub(super) fn local(doing: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Local {
            path,
            doing,
            source,
        }
    }
}
