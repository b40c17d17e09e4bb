//! The object in the frames of one video: its mask, read from a file.

use std::path::Path;

use image::{GrayImage, Luma};

use super::{Error, bounding_box};
use relit_data::geometry::Rect;
use relit_data::session::{MASK_FILE, Recording};
use relit_data::shard::Digest;

/// A pixel of the mask file is the object's from this level on, where it is not transparent.
const OBJECT: u8 = 128;
/// Part of the frame above which a mask is suspicious.
const MOST: f64 = 0.9;

/// The mask of a video.
#[derive(Debug)]
pub(super) struct Object {
    /// 0 or 255, as large as the frames.
    pub(super) mask: GrayImage,
    /// The smallest rectangle around the object, source pixels.
    pub(super) bounding_box: Rect,
    /// Of the mask's file.
    pub(super) blake3: Digest,
}

impl Object {
    /// Reads the mask that was `named`, or else the one in the recording's folder, for frames of
    /// this size. Transparent pixels are not the object's, whatever their colour.
    pub(super) fn open(
        recording: &Recording,
        named: Option<&Path>,
        frame: (u32, u32),
    ) -> Result<Self, Error> {
        let path = match (named, &recording.folder) {
            (Some(named), _) if named.is_file() => named.to_owned(),
            (Some(named), _) => return Err(Error::MaskNotThere(named.to_owned())),
            (None, Some(folder)) if folder.join(MASK_FILE).is_file() => folder.join(MASK_FILE),
            (None, Some(folder)) => return Err(Error::NoMask(folder.clone())),
            (None, None) => return Err(Error::NoMask(recording.video.clone())),
        };
        let bytes = std::fs::read(&path).map_err(|source| Error::Read {
            path: path.clone(),
            source,
        })?;
        let image = image::load_from_memory(&bytes)
            .map_err(|source| Error::Mask {
                path: path.clone(),
                source,
            })?
            .into_luma_alpha8();
        let size = image.dimensions();
        if size != frame {
            return Err(Error::MaskSize {
                path,
                mask: size,
                frame,
            });
        }
        let mask = GrayImage::from_fn(size.0, size.1, |x, y| {
            let [level, alpha] = image.get_pixel(x, y).0;
            Luma([if level >= OBJECT && alpha >= OBJECT {
                255
            } else {
                0
            }])
        });
        let bounding_box = bounding_box(&mask).ok_or(Error::EmptyMask(path))?;
        Ok(Self {
            mask,
            bounding_box,
            blake3: Digest::of(&bytes),
        })
    }

    /// What is suspicious about the mask.
    pub(super) fn warning(&self) -> Option<String> {
        let under = self
            .mask
            .as_raw()
            .iter()
            .filter(|&&level| level != 0)
            .count();
        let part = under as f64 / self.mask.as_raw().len() as f64;
        (part > MOST).then(|| {
            format!(
                "the mask covers {:.0} % of the frame: is it the object's?",
                100.0 * part
            )
        })
    }
}
