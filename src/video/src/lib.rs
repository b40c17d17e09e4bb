//! Reading and writing videos with FFmpeg: a file becomes frames with numbers and time stamps, and
//! frames become RGB pictures; a [`Muxer`] writes a camera's stream to a file.
//!
//! Opening a [`Video`] reads through the file once: which frames it has, in order of presentation, the time of each, and
//! whether the file is complete. It decodes only where packets do not tell which pictures there are (fields, streams that
//! were cut or joined, some older codecs). A [`Reader`] then returns the
//! wanted frames. If each frame is coded on its own (Motion JPEG, raw video), it returns compressed
//! frames, which any number of threads can decode in parallel; otherwise FFmpeg's own threads decode
//! ahead. Memory does not grow with the length of the video, except for about 30 bytes a frame.
//!
//! Colour range (limited, full), matrix, primaries and transfer function are respected: pictures are sRGB, of HDR with
//! 203 cd/m² as white. They are turned and their pixels are square, as players show them. Variable frame rate and gaps in
//! the time stamps are kept. [`PixelFormat`] is the one type for how a
//! camera's frames are coded. This crate knows nothing of sessions, masks or angles.
//!
//! ```
//! use std::path::Path;
//!
//! # std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).unwrap();
//! use relit_video::{Muxer, PixelFormat, StreamFormat, Video};
//!
//! let video = Video::open(Path::new("fixtures/20261120T101500Z-cow-short/video.mkv"))?;
//! assert_eq!((video.frames().len(), video.damage().len()), (150, 0));
//! let picture = video.frame(7)?;
//! assert_eq!(picture.dimensions(), (480, 360));
//!
//! // Its first frames again, as they are coded.
//! # let folder = tempfile::tempdir()?;
//! let path = folder.path().join("copy.mkv");
//! let stream = StreamFormat {
//!     format: PixelFormat::Mjpeg,
//!     width: 480,
//!     height: 360,
//!     fps: 30.0,
//! };
//! let mut muxer = Muxer::create(&path, stream)?;
//! for (coded, frame) in video.packets()?.zip(video.frames()).take(10) {
//!     muxer.write(&coded.data, frame.t_us)?;
//! }
//! muxer.finish()?;
//! assert!(Video::open(&path)?.frame(7)? == picture);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod annexb;
mod colour;
mod decoder;
mod display;
mod ffv1;
mod format;
mod jpeg;
mod live;
mod lossless;
mod matroska;
mod mux;
mod nal;
mod order;
mod orientation;
mod packet_contents;
mod packets;
mod part;
mod photograph;
mod picture;
mod raw;
mod reader;
mod sampling;
mod scan;
mod seek;
mod survey;
mod track;

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Once;

use ffmpeg_next::Dictionary;
use ffmpeg_next::format::context::Input;
use ffmpeg_next::format::input_with_dictionary;
use relit_data::disk::DISK_FULL;
use relit_data::still::Format;

use photograph::{format_of, is_misread};

pub use format::{BayerPattern, PixelFormat, StreamFormat};
pub use live::LiveDecoder;
pub use matroska::{Truncation, find_truncation};
pub use mux::{Muxer, WriteOutcome};
pub use nal::is_key;
pub use order::FrameInfo;
pub use packets::{CodedFrame, Packets};
pub use picture::Picture;
pub use reader::{Pending, Reader};
pub use scan::{Facts, Video};
pub use seek::first_picture;

/// Why a video could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum VideoError {
    /// The file has no pictures that can be read: why, as the rest of a sentence, and what to do.
    #[error("{path} {why}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// A frame beyond the end.
    #[error("{path} has no frame {number}: give one of 0 to {last}")]
    NoSuchFrame {
        /// The file.
        path: PathBuf,
        /// The frame that was requested.
        number: u64,
        /// The last one.
        last: u64,
    },
    /// A frame of the file that cannot be decoded.
    #[error("frame {number} of {path} cannot be decoded: {fault}; take another frame")]
    Frame {
        /// The file.
        path: PathBuf,
        /// The frame.
        number: u64,
        /// What is wrong with it.
        fault: DecodeFault,
    },
    /// The disk is full.
    #[error(
        "{DISK_FULL}: {missing} bytes of what was recorded could not be written to {path}; free some space in {folder}, or record elsewhere",
        folder = folder_of(path).display()
    )]
    DiskFull {
        /// The file.
        path: PathBuf,
        /// Bytes that were taken and did not fit.
        missing: u64,
        /// The system's answer: the disk, a quota or a limit on file sizes is exhausted.
        source: io::Error,
    },
    /// Another error of the file system.
    #[error(
        "{path} could not be written ({source}): check the folder's rights and that the disk is in order"
    )]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
    /// FFmpeg cannot code the pictures, or they are not what was agreed: what is wrong, and what to do.
    #[error("{0}")]
    Refused(String),
}

impl VideoError {
    fn unreadable(path: &Path, why: impl Into<String>) -> Self {
        Self::Unreadable {
            path: path.to_owned(),
            why: why.into(),
        }
    }

    fn no_video(path: &Path) -> Self {
        Self::unreadable(path, "has no video stream: give a file with a picture")
    }

    /// For `map_err`: that no decoder can be opened.
    fn decoder(path: &Path, codec: &str) -> impl FnOnce(ffmpeg_next::Error) -> Self {
        move |why| {
            let why = format!(
                "cannot be decoded: no decoder for its codec {codec} can be opened ({why})"
            );
            Self::unreadable(path, why)
        }
    }
}

/// The folder of a file.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

/// Why a frame cannot be decoded to a picture.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DecodeFault {
    /// The decoder refused its data.
    #[error("its data are damaged ({0})")]
    Damaged(ffmpeg_next::Error),
    /// A picture cannot be trusted or is of the wrong kind: why.
    #[error("{0}")]
    Unusable(String),
    /// The pixel format cannot be converted to RGB.
    #[error("its pixel format {0} cannot be converted to RGB")]
    PixelFormat(String),
    /// The file ends before it, although it held it when it was opened.
    #[error("the video ends before it, although it had it when it was opened")]
    Unread,
}

impl DecodeFault {
    /// The decoder concealed missing parts.
    fn concealed() -> Self {
        Self::Unusable("parts of it are missing and were concealed by the decoder".to_owned())
    }

    fn no_picture() -> Self {
        Self::Unusable("the decoder gave no picture for it".to_owned())
    }

    /// According to the container or a checksum, its data are incomplete.
    fn not_whole() -> Self {
        Self::Unusable("its data are not whole".to_owned())
    }
}

/// Opens a file, and only this file: FFmpeg treats a name with a colon as a URL, and a picture's name with a per cent sign
/// as a pattern of many.
fn open_input(path: &Path) -> Result<Input, VideoError> {
    initialise();
    let name = path.to_str().filter(|name| !name.contains('\0'));
    let no_text = "has a name that is not plain text: rename the file";
    let name = name.ok_or_else(|| VideoError::unreadable(path, no_text))?;
    let still = format_of(path);
    let failed = |why| {
        let why = match still.and_then(Format::unsupported) {
            Some((name, advice)) => format!("is {name}, which is not supported: {advice}"),
            None => format!(
                "cannot be opened as a video ({why}): is it complete, and is it a video? `ffprobe` shows more"
            ),
        };
        VideoError::unreadable(path, why)
    };
    if still.is_some_and(is_misread) {
        return Err(failed(ffmpeg_next::Error::InvalidData));
    }
    let literally = Dictionary::from_iter([("pattern_type", "none")]);
    input_with_dictionary(&format!("file:{name}"), literally).map_err(failed)
}

/// FFmpeg's one-time set-up. Without it FFmpeg prints messages to standard error.
fn initialise() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // Current versions of FFmpeg have nothing to register; a failure shows when a file is opened.
        let _ = ffmpeg_next::init();
        ffmpeg_next::log::set_level(ffmpeg_next::log::Level::Quiet);
    });
}
