//! Videos by way of FFmpeg: a file becomes frames with numbers and time stamps, and frames become
//! RGB pictures; and back: a [`Muxer`] writes what a camera delivers to a file.
//!
//! A [`Video`] is opened by reading through the file once without decoding: which frames it has,
//! in order of presentation, when each is due, and whether the file is whole. A [`Reader`] then
//! hands out the wanted frames. Where each frame stands alone (Motion JPEG, raw video) it hands out
//! compressed frames that any number of threads decode side by side; elsewhere FFmpeg's own threads
//! decode ahead. Memory does not grow with the length of the video, but for some 30 bytes a frame.
//!
//! Colour range (limited, full) and matrix are honoured, a display rotation is applied, variable
//! frame rate and gaps in the time stamps are kept as they are. This room knows nothing of
//! sessions, masks or angles.

mod annexb;
mod decoder;
mod ffv1;
mod format;
mod live;
mod lossless;
mod matroska;
mod mux;
mod nal;
mod order;
mod orientation;
mod packets;
mod picture;
mod raw;
mod reader;
mod scan;
mod seek;

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Once;

use ffmpeg_next::format::context::Input;

pub use format::{BayerPattern, PixelFormat};
pub use live::LiveDecoder;
pub use matroska::{Truncation, find_truncation};
pub use mux::{Muxer, StreamFormat, Written};
pub use nal::is_key;
pub use packets::{CodedFrame, Packets};
pub use picture::Picture;
pub use reader::{Pending, Reader};
pub use scan::{Damage, Facts, FrameInfo, Video};
pub use seek::first_picture;

/// Why a video could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum VideoError {
    /// FFmpeg cannot make anything of the file.
    #[error(
        "{path} cannot be opened as a video ({why}): is it whole, and is it a video? `ffprobe` on it tells more"
    )]
    Open {
        /// The file.
        path: PathBuf,
        /// FFmpeg's word.
        why: ffmpeg_next::Error,
    },
    /// A name that FFmpeg cannot take.
    #[error("the name of {0} is not plain text: rename the file")]
    Name(PathBuf),
    /// No picture track.
    #[error("{0} has no video stream: give a file with a picture")]
    NoVideo(PathBuf),
    /// A picture track without a single frame.
    #[error("{0} has not one whole frame: it was cut off too early; record it again")]
    NoFrames(PathBuf),
    /// The codec is not supported by this FFmpeg, or refuses the stream.
    #[error("{path}: no decoder for its codec {codec} can be opened ({why})")]
    Decoder {
        /// The file.
        path: PathBuf,
        /// The codec's name.
        codec: String,
        /// FFmpeg's word.
        why: ffmpeg_next::Error,
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
    /// A frame that is there and cannot be decoded.
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
        "no room to write {path}: {missing} bytes of what was recorded are missing there; make room in {folder}, or record elsewhere",
        folder = folder_of(path).display()
    )]
    NoRoom {
        /// The file.
        path: PathBuf,
        /// Bytes that were taken and did not fit.
        missing: u64,
    },
    /// The file system refused otherwise.
    #[error(
        "{path} could not be written ({source}): check the folder's rights and that the disk is in order"
    )]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
    /// FFmpeg refused to make the file.
    #[error("{path} could not be made ({why}): does this FFmpeg write Matroska and FFV1?")]
    Mux {
        /// The file.
        path: PathBuf,
        /// FFmpeg's word.
        why: ffmpeg_next::Error,
    },
    /// An uncompressed format that cannot have this size.
    #[error(
        "a picture of {width} x {height} pixels cannot be kept in this pixel format: choose another mode"
    )]
    PictureSize {
        /// Width, pixels.
        width: u32,
        /// Height, pixels.
        height: u32,
    },
    /// An uncompressed picture that is not one.
    #[error(
        "a picture of {width} x {height} pixels came with {found} bytes instead of {wanted}: the camera sends another size than agreed, or half a picture"
    )]
    PictureBytes {
        /// Bytes that came.
        found: usize,
        /// Bytes of a whole picture.
        wanted: usize,
        /// Width, pixels.
        width: u32,
        /// Height, pixels.
        height: u32,
    },
    /// H.264 in another form than cameras give it.
    #[error("the stream for {0} is no H.264 with start codes: choose another mode of the camera")]
    NotAnnexB(PathBuf),
}

/// The folder in which a file stands.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

/// Why one frame yields no picture.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DecodeFault {
    /// The decoder refused its data.
    #[error("its data are damaged ({0})")]
    Damaged(ffmpeg_next::Error),
    /// The container or a checksum says that its data are not whole.
    #[error("its data are not whole")]
    NotWhole,
    /// The decoder covered up missing parts.
    #[error("parts of it are missing and were covered up by the decoder")]
    Concealed,
    /// It is predicted from a frame that is damaged.
    #[error("it builds on the damaged frame {0}")]
    BuildsOnDamaged(u64),
    /// The decoder gave nothing for it.
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
}

/// Opens a file, and nothing but a file: FFmpeg would take a name with a colon for an address.
fn open_input(path: &Path) -> Result<Input, VideoError> {
    initialise();
    let name = path.to_str().filter(|name| !name.contains('\0'));
    let name = name.ok_or_else(|| VideoError::Name(path.to_owned()))?;
    let failed = |why| VideoError::Open {
        path: path.to_owned(),
        why,
    };
    ffmpeg_next::format::input(&format!("file:{name}")).map_err(failed)
}

/// FFmpeg's one-time set-up. It would print its own messages to standard error otherwise.
fn initialise() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // Registers nothing in any FFmpeg of these years; a failure shows when a file is opened.
        let _ = ffmpeg_next::init();
        ffmpeg_next::log::set_level(ffmpeg_next::log::Level::Quiet);
    });
}
