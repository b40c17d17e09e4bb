//! What the file of a photograph says beside its pixels, which FFmpeg does not tell.

use std::path::Path;

use ffmpeg_next::format::context::Input;
use image::metadata::Orientation as Exif;
use image::{ImageDecoder, ImageReader};

/// How a photograph is to be turned for display; nothing for a video, and for a picture that stands as it is stored.
pub(super) fn exif_orientation(input: &Input, path: &Path) -> Option<Exif> {
    if !is_photograph(input) {
        return None;
    }
    let reader = ImageReader::open(path).ok()?.with_guessed_format().ok()?;
    // A file whose orientation cannot be read is shown as it is stored.
    let stated = reader.into_decoder().ok()?.orientation().ok()?;
    (stated != Exif::NoTransforms).then_some(stated)
}

/// Whether FFmpeg reads the file as one picture.
fn is_photograph(input: &Input) -> bool {
    let format = input.format();
    format.name() == "image2" || format.name().ends_with("_pipe")
}
