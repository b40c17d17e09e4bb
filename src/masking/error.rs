//! What can go wrong between a recording and its mask on disk.

use std::io;
use std::path::PathBuf;

use relit_data::session;

/// Why a recording has no mask.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The frame cannot be segmented as asked.
    #[error(transparent)]
    Mask(#[from] relit_mask::Error),
    /// A name for the mask that does not end in `.png`.
    #[error("{0} cannot be the mask's name: give one that ends in .png")]
    OutputName(PathBuf),
    /// A mask for which no record vouches.
    #[error(
        "{0} was not made by this program, or was changed since: it may be somebody's handwork and is kept; give --force to replace it, or another name with -o"
    )]
    Handmade(PathBuf),
    /// Where the record would be written stands another file.
    #[error(
        "{path} would be overwritten, but is not a mask's record ({why}): move it away, or give another name with -o"
    )]
    ForeignFile {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// A recipe that cannot be followed.
    #[error("{path} cannot be used as a recipe: {why}")]
    Recipe {
        /// The record.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// The frame is not the one that the recipe was recorded on.
    #[error(
        "frame {frame} of {video} is not the frame that {recipe} was recorded on: give hints of its own, or --force to use the recorded ones"
    )]
    OtherFrame {
        /// The frame's number.
        frame: u64,
        /// The video.
        video: PathBuf,
        /// The record.
        recipe: PathBuf,
    },
    /// The recipe was followed on the same frame and gave another mask.
    #[error(
        "the mask made after {recipe} differs from the recorded one, though the frame is the same (made by {made_by}, now {now}): nothing was written; give --force to take the new mask"
    )]
    NotReproduced {
        /// The record.
        recipe: PathBuf,
        /// The software that made the recorded mask.
        made_by: String,
        /// This software.
        now: String,
    },
    /// The recording cannot be opened.
    #[error(transparent)]
    Session(#[from] session::Error),
    /// The video cannot be read.
    #[error(transparent)]
    Video(#[from] relit_video::VideoError),
    /// The file system refused.
    #[error("{path} could not be {doing}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What was to be done, as a participle: "read".
        doing: &'static str,
        /// The system's answer.
        source: io::Error,
    },
    /// Any of the others, with the recording that it concerns.
    #[error("no mask for {recording}: {source}")]
    Recording {
        /// The recording's id.
        recording: String,
        /// What went wrong.
        source: Box<Self>,
    },
}

impl Error {
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
}
