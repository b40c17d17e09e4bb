//! The kinds of file that pictures and videos are written into.

use std::path::Path;

use super::{MovieFormat, write_jpeg, write_png};
use crate::image::{Depth, ImageError, Linear, Rgb, Srgb};

/// What a file's name asks for.
///
/// ```
/// use std::path::Path;
///
/// use relight_core::files::{MovieFormat, OutputKind};
///
/// assert_eq!(OutputKind::of(Path::new("cup.EXR")), Some(OutputKind::Exr));
/// assert_eq!(OutputKind::of(Path::new("cup.mp4")), Some(OutputKind::Movie(MovieFormat::Mp4)));
/// assert_eq!(OutputKind::of(Path::new("cup.tiff")), None);
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
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?;
        match MovieFormat::of(path) {
            Some(format) => Some(Self::Movie(format)),
            None if ending.eq_ignore_ascii_case("png") => Some(Self::Png),
            None if ["jpg", "jpeg"]
                .iter()
                .any(|e| ending.eq_ignore_ascii_case(e)) =>
            {
                Some(Self::Jpeg)
            }
            None if ending.eq_ignore_ascii_case("exr") => Some(Self::Exr),
            None => None,
        }
    }
}

/// Writes a picture: linear into an EXR, encoded into a JPEG, and with so many bits into any other file, a PNG. The folder is
/// made where there is none.
///
/// # Errors
/// Where the file cannot be written.
pub fn write_picture(path: &Path, picture: &Rgb<Linear>, depth: Depth) -> Result<(), ImageError> {
    match OutputKind::of(path) {
        Some(OutputKind::Exr) => picture.write_exr(path),
        Some(OutputKind::Jpeg) => write_jpeg(path, picture.clone().encode::<Srgb>().planes()),
        _ => write_png(path, picture.clone().encode::<Srgb>().planes(), depth),
    }
}
