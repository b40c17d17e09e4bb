//! The errors of making the mask of a recording.

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;

use relit_data::session;

/// Why the mask of a recording could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MaskingError {
    /// The frame cannot be segmented with these hints.
    #[error(transparent)]
    Mask(#[from] relit_grabcut::MaskError),
    /// An image that cannot be used as seeds.
    #[error("the seeds {path} cannot be used: {fault}")]
    Seeds {
        /// The image.
        path: PathBuf,
        /// What is wrong with it.
        fault: relit_grabcut::SeedsFault,
    },
    /// A photograph's colours cannot be converted.
    #[error("{path} {fault}: convert it to sRGB")]
    Colour {
        /// The photograph.
        path: PathBuf,
        /// What it says of its colours.
        fault: relit_data::still::ColourError,
    },
    /// A name for the mask that does not end in `.png`.
    #[error("{0} cannot be the mask's name: give one that ends in .png")]
    OutputName(PathBuf),
    /// A mask that differs from its record, or has none.
    #[error(
        "{0} was not made by this program, or was changed since: it may have been painted by hand and is kept; give --force to replace it, or another name with -o"
    )]
    Handmade(PathBuf),
    /// Another file has the name of the record.
    #[error(
        "{path} would be overwritten, but is not a mask's record ({why}): move it away, or give another name with -o"
    )]
    ForeignFile {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// A record that cannot be used as a recipe.
    #[error("{path} cannot be used as a recipe: {why}")]
    Recipe {
        /// The record.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// A mask would lose its strokes, which were painted on another recording.
    #[error(
        "{0} holds strokes that were painted on another recording: give another name with -o, or --force to make the mask without them"
    )]
    StrokesOfAnother(PathBuf),
    /// The frame is not the one on which the recipe was recorded.
    #[error(
        "frame {frame} of {video} is not the frame on which {recipe} was recorded: give other hints, or --force to use the recorded ones"
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
        "the mask made with {recipe} differs from the recorded one, although the frame is the same (made by {made_by}, now {now}): nothing was written; give --force to accept the new mask"
    )]
    NotReproduced {
        /// The record.
        recipe: PathBuf,
        /// The software that made the recorded mask.
        made_by: String,
        /// This software.
        now: String,
    },
    /// A mask that cannot be checked.
    #[error("the mask {path} cannot be checked: {why}")]
    Check {
        /// The mask.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// A folder or file that cannot be measured with.
    #[error("{path} cannot be measured: {why}")]
    Bench {
        /// The folder or file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// A mask of OpenCV's GrabCut was wanted of a program that was built without it.
    #[error(
        "OpenCV is not built into this relit-mask: build it with `cargo build --release -p relit-mask --features opencv`, or leave out --engine opencv"
    )]
    WithoutOpenCv,
    /// A mask of OpenCV's GrabCut was wanted by a turn.
    #[error(
        "OpenCV's GrabCut sees one frame and no turn: give --rect or --seeds without --auto, or leave out --engine opencv"
    )]
    OpenCvKnowsNoTurn,
    /// OpenCV's GrabCut reported an error.
    #[error("OpenCV's GrabCut failed")]
    OpenCv(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// The editor cannot be served: the address is taken or not this machine's, or there are no threads or no
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
    /// The mask of one recording cannot be checked.
    #[error("{recording}: {source}")]
    Checked {
        /// The recording's id.
        recording: String,
        /// What went wrong.
        source: Box<Self>,
    },
    /// Any of the others, with the recording's id.
    #[error("no mask for {recording}: {source}")]
    Recording {
        /// The recording's id.
        recording: String,
        /// What went wrong.
        source: Box<Self>,
    },
}

impl MaskingError {
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
