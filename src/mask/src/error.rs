//! The errors of making the mask of a recording.

use std::io;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use relit_data::session;

/// Why the mask of a recording could not be made.
#[derive(Debug, thiserror::Error)]
pub enum MaskingError {
    /// The frame cannot be segmented with these hints.
    #[error(transparent)]
    Mask(#[from] relit_grabcut::MaskError),
    /// A file that is given cannot be used.
    #[error("the {what} {path} cannot be used: {why}")]
    Unusable {
        /// What it is given as: "seeds", "recipe", "mask", "photograph", "network".
        what: &'static str,
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// A name for the mask that does not end in `.png`.
    #[error("{0} cannot be the mask's name: give one that ends in .png")]
    OutputName(PathBuf),
    /// A mask that differs from its record, or has none.
    #[error(
        "{0} was not made by this program, or was changed since: give --force to replace it, or another name with -o"
    )]
    Handmade(PathBuf),
    /// What is to be written has the name of a file that the mask is made from.
    #[error(
        "{0} is an input, and would be overwritten: give another name, or a folder for masks, with -o"
    )]
    IsInput(PathBuf),
    /// The mask that is there is that of another recording.
    #[error(
        "{mask} was made of another input, whose file is called {input}: give another name with -o, or --force to replace it"
    )]
    OtherInput {
        /// The mask.
        mask: PathBuf,
        /// The video or photograph that it was made of, as its record names it.
        input: String,
    },
    /// Another file has the name of the record, or of the preview.
    #[error("{path} would be overwritten, but {why}: move it away, or give another name with -o")]
    ForeignFile {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// The request does not fit the recording, the mask that is there, or this program: why, and what to do.
    #[error("{0}")]
    Refused(String),
    /// A network sees no object in the frame, or none in the rectangle.
    #[error(
        "the network {0} found no object: give a rectangle around it with --rect, or mark it in --seeds without --model"
    )]
    NothingFound(PathBuf),
    /// OpenCV's GrabCut reported an error.
    #[error("OpenCV's GrabCut failed")]
    OpenCv(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// The editor cannot be served: the address is taken or not this machine's, or the system has no threads or no
    /// random numbers.
    #[error(
        "the editor cannot be served at {address}: {source}; give another address or port with --listen"
    )]
    Serve {
        /// The address.
        address: SocketAddr,
        /// The system's answer.
        source: io::Error,
    },
    /// The recording cannot be opened.
    #[error(transparent)]
    Session(#[from] session::SessionError),
    /// The video cannot be read.
    #[error(transparent)]
    Video(#[from] relit_video::VideoError),
    /// A file could not be read or written.
    #[error("{path} could not be {doing}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What was attempted, as a participle: "read".
        doing: &'static str,
        /// The system's error.
        source: io::Error,
    },
}

impl MaskingError {
    /// The mask that was made by hand, if that is why none was made.
    #[must_use]
    pub fn handmade(&self) -> Option<&Path> {
        match self {
            Self::Handmade(mask) => Some(mask),
            _ => None,
        }
    }

    pub(super) fn io(
        path: impl Into<PathBuf>,
        doing: &'static str,
    ) -> impl FnOnce(io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io {
            path,
            doing,
            source,
        }
    }

    pub(super) fn unusable(
        what: &'static str,
        path: impl Into<PathBuf>,
        why: &impl ToString,
    ) -> Self {
        let (path, why) = (path.into(), why.to_string());
        Self::Unusable { what, path, why }
    }
}
