//! The kinds of file that pictures and videos are written into.

use std::path::Path;

use relight_core::files::write_jpeg;
use relight_core::image::{ImageError, Linear, Rgb, Srgb};

use super::MovieFormat;

/// What a file's name asks for.
///
/// ```
/// use std::path::Path;
///
/// use relight_photo::files::{MovieFormat, OutputKind};
///
/// assert_eq!(OutputKind::from_path(Path::new("cup.EXR")), Some(OutputKind::Exr));
/// assert_eq!(OutputKind::from_path(Path::new("cup.mp4")), Some(OutputKind::Movie(MovieFormat::Mp4)));
/// assert_eq!(OutputKind::from_path(Path::new("cup.tiff")), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutputKind {
    /// A picture, encoded.
    Png,
    /// A picture, encoded with 8 bits and a little loss.
    Jpeg,
    /// A picture, linear.
    Exr,
    /// A video.
    Movie(MovieFormat),
}

impl OutputKind {
    /// What a file's ending asks for.
    pub fn from_path(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match ending.as_str() {
            "png" => Self::Png,
            "jpg" | "jpeg" => Self::Jpeg,
            "exr" => Self::Exr,
            "mp4" => Self::Movie(MovieFormat::Mp4),
            "webm" => Self::Movie(MovieFormat::Webm),
            _ => return None,
        })
    }
}

/// Writes a picture: linear into an EXR, encoded into a JPEG, and with 8 bits into any other file, a PNG. A missing folder
/// is made.
///
/// # Errors
/// If the file cannot be written.
pub fn write_picture(path: &Path, picture: &Rgb<Linear>) -> Result<(), ImageError> {
    match OutputKind::from_path(path) {
        Some(OutputKind::Exr) => picture.write_exr(path),
        Some(OutputKind::Jpeg) => write_jpeg(path, picture.clone().encode::<Srgb>().planes()),
        _ => picture.clone().encode::<Srgb>().write_png(path),
    }
}
