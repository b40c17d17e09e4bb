//! The errors of an extraction.

use std::path::PathBuf;

use relit_data::geometry::Rect;
use relit_data::mask::{MaskFault, size_hint};
use relit_data::{report, session, shard};
use relit_video as video;

/// Why a recording, or all of them, could not be extracted.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExtractError {
    /// An option is out of range.
    #[error("{name} is {value}: give {allowed}")]
    Option {
        /// The option.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The output folder holds a data set with other settings.
    #[error(
        "{out} holds a data set with other settings ({differ}): give the same ones, or another folder"
    )]
    OtherSettings {
        /// The output folder.
        out: PathBuf,
        /// The settings that differ.
        differ: String,
    },
    /// A page would take the place of a file of the data set.
    #[error("{0} is a file of the data set: give the page another name")]
    PageInTheWay(PathBuf),
    /// A page that somebody wrote would be lost.
    #[error(
        "{0} was not written by relit-extract card: move it away, and put its words into the new one"
    )]
    OwnReadme(PathBuf),
    /// Two recordings have the same name.
    #[error(
        "another recording of this call is also named {0}: extract them into different folders, or rename one"
    )]
    SameName(String),
    /// Two recordings have names that are one on some file systems.
    #[error(
        "the name {id} is that of {other} where a file system ignores case, and their files would replace each other: rename one, or extract it into another folder"
    )]
    NameAlike {
        /// The recording's id.
        id: String,
        /// That of the one before it, of this call or in the data set.
        other: String,
    },
    /// There is no mask.
    #[error("{0} has no mask: make one with relit-mask, or name one with --mask")]
    NoMask(PathBuf),
    /// The given mask does not exist.
    #[error("there is no mask {0}: make one with relit-mask, or correct the name given to --mask")]
    MaskNotThere(PathBuf),
    /// The frame index and the video do not belong together.
    #[error(
        "frames.jsonl has {lines} lines and the video has {frames} frames, and their time stamps do not match: give the video file itself to go on without angles"
    )]
    IndexMismatch {
        /// Lines of the index.
        lines: u64,
        /// Frames of the video.
        frames: u64,
    },
    /// Something in a folder of sessions is none.
    #[error("it is no session and holds no video")]
    NoRecording,
    /// Extracting a recording panicked.
    #[error("a fault of the program, described above: please report it")]
    Panic,
    /// The mask cannot be read.
    #[error("the mask {path} {source}")]
    Mask {
        /// The mask's path.
        path: PathBuf,
        /// What it is.
        source: relit_still::StillError,
    },
    /// The mask cannot be held against the video.
    #[error(transparent)]
    MaskDoubts(#[from] relit_grabcut::MaskError),
    /// Mask and frames differ in size.
    #[error(
        "the mask {path} is {} x {} pixels and the frames are {} x {}: {}",
        mask.0, mask.1, frame.0, frame.1,
        size_hint(*mask, *frame).unwrap_or("make the mask on a frame of this video")
    )]
    MaskSize {
        /// The mask's path.
        path: PathBuf,
        /// The mask's width and height.
        mask: (u32, u32),
        /// The frames' width and height.
        frame: (u32, u32),
    },
    /// The mask marks nothing, or is none.
    #[error("the mask {path} {fault}")]
    NotAMask {
        /// The mask's path.
        path: PathBuf,
        /// What it is.
        fault: MaskFault,
    },
    /// The scaled mask marks no pixel.
    #[error(
        "the object is too small: at {side} pixels it covers half of no pixel of the output; give a larger --size or a smaller --margin"
    )]
    ObjectTooSmall {
        /// The output's side, pixels.
        side: u32,
    },
    /// The crop would need too much memory.
    #[error("a crop of {} x {} pixels is too large: give a smaller --margin", .0.w, .0.h)]
    CropTooLarge(Rect),
    /// Scaling failed.
    #[error("a frame could not be scaled: {0}")]
    Scaling(&'static str),
    /// No frame can be decoded.
    #[error("no frame of the video can be decoded: record it again, or give another file")]
    NoFrameLeft,
    /// The video has a single frame.
    #[error("the video has one usable frame only: give a recording of a turn")]
    OneFrame,
    /// The data set holds a session of this name from another video.
    #[error(
        "{out} holds a session {id} from another video: extract into another folder, rename the input, or give --replace"
    )]
    NameTaken {
        /// The output folder.
        out: PathBuf,
        /// The session's id.
        id: String,
    },
    /// The output folder is a session folder.
    #[error("{0} is a session folder: give another one for the data set")]
    IntoSession(PathBuf),
    /// The table did not turn.
    #[error(
        "the table turned by only {degrees:.2} degrees: to spread the frames over time, give the video file itself"
    )]
    TableStands {
        /// Angle from the first frame to the last, degrees.
        degrees: f64,
    },
    /// The recording is part of a turn.
    #[error(
        "the frames cover {covered_deg:.1} of 360 degrees: --partial makes the samples that are there, or record it again"
    )]
    PartOfATurn {
        /// Degrees that are there.
        covered_deg: f64,
    },
    /// The capture ended within the first degree of its turn.
    #[error(
        "the frames cover {covered_deg:.1} of 360 degrees, which is too little: record it again"
    )]
    TooLittleOfATurn {
        /// Degrees that are there.
        covered_deg: f64,
    },
    /// The recording is part of a turn, and no angle is known.
    #[error(
        "the frames cover about {covered_deg:.0} of 360 degrees, and their angles are not known: record it again, or give the video file itself to spread the frames over time"
    )]
    NoAngles {
        /// Degrees that are there, by the planned speed.
        covered_deg: f64,
    },
    /// The object moved further than it may.
    #[error(
        "from frame {frame} on the object lies {shift_px:.1} pixels away from its place in the mask, more than {max_shift}: was it or the camera pushed? Record it again, make the mask on another frame, or give a larger --max-shift"
    )]
    Moved {
        /// The first such frame.
        frame: u64,
        /// How far, source pixels.
        shift_px: f64,
        /// The largest that was allowed, source pixels.
        max_shift: f64,
    },
    /// With `strict`: a frame is used twice or something is lost.
    #[error("refused by --strict: {0}")]
    Strict(String),
    /// The recording cannot be used.
    #[error(transparent)]
    Session(#[from] session::SessionError),
    /// The video cannot be used.
    #[error(transparent)]
    Video(#[from] video::VideoError),
    /// A frame cannot be converted.
    #[error(
        "frame {number}: {fault}; convert the video to another pixel format, for example with ffmpeg"
    )]
    Frame {
        /// The frame.
        number: u64,
        /// What is wrong with it.
        fault: video::DecodeFault,
    },
    /// The data set cannot be written.
    #[error(transparent)]
    Shard(#[from] shard::ShardError),
    /// An object store cannot be used.
    #[error(transparent)]
    Objects(#[from] super::objects::ObjectError),
    /// The report cannot be made.
    #[error(transparent)]
    Report(#[from] report::ReportError),
    /// The worker threads cannot be started.
    #[error("the worker threads could not be started: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// A file cannot be read.
    #[error("{path} could not be read: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
}

impl ExtractError {
    /// The error as it is for a capture that was aborted, whose table did turn.
    pub(super) fn of_an_aborted_capture(self) -> Self {
        match self {
            Self::OneFrame => Self::TooLittleOfATurn { covered_deg: 0.0 },
            Self::TableStands { degrees } => Self::TooLittleOfATurn {
                covered_deg: degrees,
            },
            other => other,
        }
    }

    /// Whether the recording itself is the reason: it holds too little of a turn, and is left out.
    #[must_use]
    pub fn leaves_out(&self) -> bool {
        matches!(
            self,
            Self::PartOfATurn { .. }
                | Self::TooLittleOfATurn { .. }
                | Self::NoAngles { .. }
                | Self::Session(session::SessionError::NoFrames(_))
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_capture_that_was_aborted_at_its_first_frames_is_left_out() {
        for error in [
            ExtractError::OneFrame,
            ExtractError::TableStands { degrees: 0.5 },
        ] {
            assert!(!error.leaves_out(), "{error}");
            let aborted = error.of_an_aborted_capture();
            assert!(aborted.leaves_out(), "{aborted}");
        }
    }
}
