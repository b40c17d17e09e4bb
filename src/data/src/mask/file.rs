//! The mask of a video, out of its file.

use std::io;
use std::path::Path;

use image::imageops::{FilterType, resize};
use image::{GenericImageView, GrayImage};

use super::{MaskFault, MaskPicture, size_hint};
use crate::still::{self, StillError};

/// The mask of a video's frames.
#[derive(Debug, Clone)]
pub struct VideoMask {
    /// 255 on the object and 0 elsewhere, in the size of the frames.
    pub image: GrayImage,
    /// Its file.
    pub bytes: Vec<u8>,
    /// The frame on which it was made, if its record says so.
    pub frame: Option<u64>,
    /// What a person may want to know of it, after "the mask".
    pub note: Option<String>,
}

/// Why a file is not the mask of a video: to be put after "the mask" and its path.
#[derive(Debug, thiserror::Error)]
pub enum VideoMaskFault {
    /// It cannot be read.
    #[error("could not be read: check that it exists and may be read")]
    Io(#[source] io::Error),
    /// It cannot be decoded.
    #[error(transparent)]
    Picture(#[from] StillError),
    /// It has another size than the frames.
    #[error(
        "is {} x {} pixels and the frames are {} x {}: {}",
        .found.0,
        .found.1,
        .frame.0,
        .frame.1,
        size_hint(*.found, *.frame).unwrap_or("make the mask on a frame of this video")
    )]
    Size {
        /// Its width and height, pixels.
        found: (u32, u32),
        /// Those of the frames.
        frame: (u32, u32),
    },
    /// Nobody knows what it marks.
    #[error(transparent)]
    Marks(#[from] MaskFault),
}

impl VideoMask {
    /// Reads the mask of frames of this size. One of the size in which the frames are `stored`, with pixels that are not square,
    /// is stretched as they are.
    ///
    /// # Errors
    /// [`VideoMaskFault`].
    pub fn read(
        path: &Path,
        frame: (u32, u32),
        stored: (u32, u32),
    ) -> Result<Self, VideoMaskFault> {
        let bytes = std::fs::read(path).map_err(VideoMaskFault::Io)?;
        let picture = still::decode(&bytes)?;
        let found = picture.dimensions();
        if found != frame && found != stored {
            return Err(VideoMaskFault::Size { found, frame });
        }
        let object = MaskPicture::from_image(&picture).object()?;
        let levels = object.inside.iter().map(|&inside| u8::from(inside) * 255);
        let image = GrayImage::from_raw(found.0, found.1, levels.collect()).unwrap_or_default();
        Ok(Self {
            image: stretched(image, frame),
            frame: frame_of(path, &bytes),
            bytes,
            note: object.note(found.0),
        })
    }
}

fn stretched(mask: GrayImage, frame: (u32, u32)) -> GrayImage {
    if mask.dimensions() == frame {
        return mask;
    }
    let mut image = resize(&mask, frame.0, frame.1, FilterType::Triangle);
    for level in image.iter_mut() {
        *level = if *level < 128 { 0 } else { 255 };
    }
    image
}

/// The frame on which a mask was made, by its record (`mask.json` of `mask.png`). A record that is
/// damaged, or that of another mask, says nothing.
fn frame_of(mask: &Path, bytes: &[u8]) -> Option<u64> {
    let record = std::fs::read(mask.with_extension("json")).ok()?;
    let record: serde_json::Value = serde_json::from_slice(&record).ok()?;
    let blake3 = blake3::hash(bytes).to_hex();
    let of_this_mask = record["result"]["mask_blake3"].as_str()? == blake3.as_str();
    record["source"]["frame"].as_u64().filter(|_| of_this_mask)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: (u32, u32) = (8, 4);

    fn mask(path: &Path, (width, height): (u32, u32)) {
        let is_inside = |x| if x < width / 2 { 255 } else { 0 };
        let mask = GrayImage::from_fn(width, height, |x, _| image::Luma([is_inside(x)]));
        mask.save(path).unwrap();
    }

    #[test]
    fn the_frame_of_a_mask_is_read_from_its_own_record_only() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.png");
        mask(&path, FRAME);
        let frame = || VideoMask::read(&path, FRAME, FRAME).unwrap().frame;
        assert_eq!(frame(), None);
        let blake3 = blake3::hash(&std::fs::read(&path).unwrap()).to_hex();
        for (of, found) in [(blake3.as_str(), Some(7)), ("another", None)] {
            let record =
                format!(r#"{{"source": {{"frame": 7}}, "result": {{"mask_blake3": "{of}"}}}}"#);
            std::fs::write(path.with_extension("json"), record).unwrap();
            assert_eq!(frame(), found);
        }
    }

    #[test]
    fn a_mask_of_the_stored_size_is_stretched_and_of_another_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.png");
        mask(&path, (6, 4));
        let found = VideoMask::read(&path, FRAME, (6, 4)).unwrap();
        assert_eq!(found.image.dimensions(), FRAME);
        let inside = |x| found.image.get_pixel(x, 1).0[0];
        assert_eq!((inside(0), inside(7)), (255, 0));
        let refused = VideoMask::read(&path, FRAME, FRAME).unwrap_err();
        assert!(matches!(
            refused,
            VideoMaskFault::Size { found: (6, 4), .. }
        ));
    }
}
