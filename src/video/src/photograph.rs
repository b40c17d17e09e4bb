//! What the file of a photograph says beside its pixels, which FFmpeg does not tell.

use std::fs::{self, File};
use std::io::Read;
use std::path::Path;

use ffmpeg_next::format::context::Input;
use image::metadata::Orientation as Exif;
use relit_data::still::Format;

/// Bytes of a file that show its format.
const HEAD: u64 = 4096;

/// How a photograph is to be turned for display; nothing for a video, and for a picture that stands as it is stored.
pub(super) fn exif_orientation(input: &Input, path: &Path) -> Option<Exif> {
    if !is_photograph(input) && !is_photograph_in_boxes(path) {
        return None;
    }
    // A file whose orientation cannot be read is shown as it is stored.
    relit_data::still::orientation(&fs::read(path).ok()?)
}

/// Whether a file is AVIF or HEIF, which FFmpeg reads as it reads MP4.
fn is_photograph_in_boxes(path: &Path) -> bool {
    matches!(format_of(path), Some(Format::Avif | Format::Heic))
}

/// The format of a still image; none of a video, and where it cannot be read.
pub(super) fn format_of(path: &Path) -> Option<Format> {
    let mut head = Vec::new();
    let read = File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    read.ok().and_then(|_| Format::sniff(&head))
}

/// Whether FFmpeg would give another picture than the file shows, or none: of a raw file the small one for display, of a
/// HEIC one of its tiles.
pub(super) fn is_misread(format: Format) -> bool {
    [
        Format::RAW,
        Format::Heic,
        Format::SVG,
        Format::PDF,
        Format::HTML,
    ]
    .contains(&format)
}

/// Whether FFmpeg reads the file as one picture.
pub(super) fn is_photograph(input: &Input) -> bool {
    let format = input.format();
    format.name() == "image2" || format.name().ends_with("_pipe")
}
