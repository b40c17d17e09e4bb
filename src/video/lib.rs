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
mod contents;
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
use relit_data::colour::ColourFault;
use relit_data::disk::DISK_FULL;
use relit_still::Format;

use photograph::{format_of, is_misread};

pub use format::{BayerPattern, PixelFormat, StreamFormat};
pub use live::LiveDecoder;
pub use matroska::{Truncation, find_truncation};
pub use mux::{Muxer, Written};
pub use nal::is_key;
pub use order::FrameInfo;
pub use packets::{CodedFrame, Packets};
pub use picture::Picture;
pub use reader::{Pending, Reader};
pub use scan::{Damage, Facts, Video};
pub use seek::first_picture;

/// Why a video could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VideoError {
    /// FFmpeg cannot read the file.
    #[error(
        "{path} cannot be opened as a video ({why}): is it complete, and is it a video? `ffprobe` shows more"
    )]
    Open {
        /// The file.
        path: PathBuf,
        /// FFmpeg's answer.
        why: ffmpeg_next::Error,
    },
    /// A still image in a format that is not read.
    #[error("{path} is {}, which is not read: {}", format.name(), format.advice())]
    Still {
        /// The file.
        path: PathBuf,
        /// Its format.
        format: Format,
    },
    /// A name that FFmpeg cannot take.
    #[error("the name of {0} is not plain text: rename the file")]
    Name(PathBuf),
    /// No picture track.
    #[error("{0} has no video stream: give a file with a picture")]
    NoVideo(PathBuf),
    /// A picture track without a single frame.
    #[error("{0} has no complete frame: it was truncated too early; record it again")]
    NoFrames(PathBuf),
    /// The codec is not supported by this FFmpeg, or refuses the stream.
    #[error("{path}: no decoder for its codec {codec} can be opened ({why})")]
    Decoder {
        /// The file.
        path: PathBuf,
        /// The codec's name.
        codec: String,
        /// FFmpeg's answer.
        why: ffmpeg_next::Error,
    },
    /// Colours that are not known here.
    #[error(
        "{path}: {fault} cannot be converted to sRGB: convert the video to SDR with BT.709 colours first"
    )]
    Colour {
        /// The file.
        path: PathBuf,
        /// What cannot be converted.
        fault: ColourFault,
    },
    /// A frame beyond the end.
    #[error("{path} has no frame {number}: give one of 0 to {last}")]
    NoSuchFrame {
        /// The file.
        path: PathBuf,
        /// The frame that was asked for.
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
    /// FFmpeg cannot create the file.
    #[error("{path} could not be created ({why}): does this FFmpeg write Matroska and FFV1?")]
    Mux {
        /// The file.
        path: PathBuf,
        /// FFmpeg's answer.
        why: ffmpeg_next::Error,
    },
    /// An uncompressed format that cannot have this size.
    #[error("{width} x {height} pixels are not possible in this pixel format: choose another mode")]
    PictureSize {
        /// Width, pixels.
        width: u32,
        /// Height, pixels.
        height: u32,
    },
    /// An uncompressed picture with the wrong number of bytes.
    #[error(
        "a picture of {width} x {height} pixels has {found} bytes instead of {wanted}: the camera sends another size than agreed, or half a picture"
    )]
    PictureBytes {
        /// Bytes that it has.
        found: usize,
        /// Bytes that it should have.
        wanted: usize,
        /// Width, pixels.
        width: u32,
        /// Height, pixels.
        height: u32,
    },
    /// H.264 in another form than cameras deliver it.
    #[error("the stream for {0} is not H.264 with start codes: choose another mode of the camera")]
    NotAnnexB(PathBuf),
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
#[non_exhaustive]
pub enum DecodeFault {
    /// The decoder refused its data.
    #[error("its data are damaged ({0})")]
    Damaged(ffmpeg_next::Error),
    /// According to the container or a checksum, its data are incomplete.
    #[error("its data are not whole")]
    NotWhole,
    /// The decoder concealed missing parts.
    #[error("parts of it are missing and were covered up by the decoder")]
    Concealed,
    /// It is predicted from a damaged frame.
    #[error("it builds on the damaged frame {0}")]
    BuildsOnDamaged(u64),
    /// The decoder returned nothing for it.
    #[error("the decoder gave no picture for it")]
    NoPicture,
    /// The picture's size changes in the middle of the video.
    #[error("it is {found_w} x {found_h} pixels in a video of {wanted_w} x {wanted_h}")]
    Size {
        /// Width found.
        found_w: u32,
        /// Height found.
        found_h: u32,
        /// The video's width.
        wanted_w: u32,
        /// The video's height.
        wanted_h: u32,
    },
    /// The pixel format cannot be converted to RGB.
    #[error("its pixel format {0} cannot be converted to RGB")]
    PixelFormat(String),
    /// Its colours cannot be converted to sRGB.
    #[error("{0} cannot be converted to sRGB")]
    Colour(#[from] ColourFault),
}

/// Opens a file, and only this file: FFmpeg takes a name with a colon for a URL, and that of a picture with a per cent sign
/// for those of many.
fn open_input(path: &Path) -> Result<Input, VideoError> {
    initialise();
    let name = path.to_str().filter(|name| !name.contains('\0'));
    let name = name.ok_or_else(|| VideoError::Name(path.to_owned()))?;
    let still = format_of(path);
    let failed = |why| match still.filter(|format| !format.is_read()) {
        Some(format) => VideoError::Still {
            path: path.to_owned(),
            format,
        },
        None => VideoError::Open {
            path: path.to_owned(),
            why,
        },
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
