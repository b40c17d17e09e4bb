//! The kinds of file that pictures and videos are written into.

use std::path::Path;

use super::{MovieFormat, write_png};
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
            None if ending.eq_ignore_ascii_case("exr") => Some(Self::Exr),
            None => None,
        }
    }
}

/// Writes a picture: linear into an EXR, encoded with so many bits into any other file, a PNG.
///
/// # Errors
/// Where the file cannot be written.
pub fn write_picture(path: &Path, picture: &Rgb<Linear>, depth: Depth) -> Result<(), ImageError> {
    match OutputKind::of(path) {
        Some(OutputKind::Exr) => picture.write_exr(path),
        _ => {
            let encoded = picture.clone().encode::<Srgb>().into_planes();
            write_png(path, &encoded, depth)
        }
    }
}
