//! The mask of the object, read from a file.

use std::path::Path;

use image::GrayImage;

use relit_data::causes::with_causes;
use relit_data::geometry::Rect;
use relit_data::mask::{VideoMask, bounding_box};
use relit_data::session::{MASK_FILE, Recording, mask_in, mask_stem};
use relit_data::shard::Digest;

use super::ExtractError;

/// A mask that covers more than this fraction of the frame is suspicious.
pub(super) const LARGE: f64 = 0.9;

/// The mask of a video.
#[derive(Debug)]
pub(super) struct ObjectMask {
    /// 0 or 255, in the size of the frames.
    pub(super) image: GrayImage,
    /// The smallest rectangle around the object, source pixels.
    pub(super) bounding_box: Rect,
    /// BLAKE3 of the mask's file.
    pub(super) blake3: Digest,
    /// The frame on which it was made, if its record says so.
    pub(super) frame: Option<u64>,
    /// What its file was taken for, where that is not plain.
    note: Option<String>,
}

/// That the mask that was named is not there.
pub(super) fn missing_mask(named: &Path) -> ExtractError {
    ExtractError::Refused(format!(
        "the mask {} does not exist: make one with relit-mask, or correct --mask",
        named.display()
    ))
}

impl ObjectMask {
    /// Reads the mask `named`, or that of the recording in a folder `named`, or else the one in the recording's folder,
    /// for frames of this size.
    /// A mask of the size in which the frames are `stored`, with pixels that are not square, is stretched as they are.
    pub(super) fn open(
        recording: &Recording,
        named: Option<&Path>,
        frame: (u32, u32),
        stored: (u32, u32),
    ) -> Result<Self, ExtractError> {
        let refused = |text| Err(ExtractError::Refused(text));
        let path = match (named, &recording.folder) {
            (Some(named), _) if named.is_file() => named.to_owned(),
            (Some(masks), _) if masks.is_dir() => {
                mask_in(masks, recording).ok_or_else(|| no_mask_in(masks, recording))?
            }
            (Some(named), _) => return Err(missing_mask(named)),
            (None, Some(folder)) if folder.join(MASK_FILE).is_file() => folder.join(MASK_FILE),
            (None, folder) => {
                let recording = folder.as_ref().unwrap_or(&recording.video).display();
                return refused(format!(
                    "{recording} has no mask: make one with relit-mask, or name one with --mask"
                ));
            }
        };
        let of_this_mask =
            |what: String| ExtractError::Refused(format!("the mask {} {what}", path.display()));
        let mask = VideoMask::read(&path, frame, stored);
        let mask = mask.map_err(|fault| of_this_mask(with_causes(&fault)))?;
        let note = mask.note;
        Ok(Self {
            bounding_box: bounding_box(&mask.image)
                .unwrap_or_else(|| Rect::new(0, 0, frame.0, frame.1)),
            frame: mask.frame,
            image: mask.image,
            blake3: Digest::hash(&mask.bytes),
            note: note.map(|note| format!("the mask {} {note}", path.display())),
        })
    }

    /// Warnings, if the mask is suspicious, or one of a kind that may be meant in another way.
    pub(super) fn warnings(&self) -> impl Iterator<Item = String> {
        self.note.clone().into_iter().chain(self.large_warning())
    }

    fn large_warning(&self) -> Option<String> {
        let levels = self.image.as_raw();
        let covered = levels.iter().filter(|&&level| level != 0).count();
        let fraction = covered as f64 / levels.len() as f64;
        (fraction > LARGE).then(|| {
            format!(
                "the mask covers {:.0} % of the frame: check that it is the object's",
                100.0 * fraction
            )
        })
    }
}

fn no_mask_in(masks: &Path, recording: &Recording) -> ExtractError {
    let named_after = recording.folder.as_deref().unwrap_or(&recording.video);
    ExtractError::Refused(format!(
        "{} has no {}.png, the mask of this recording: make one with relit-mask -o {}/",
        masks.display(),
        mask_stem(named_after).to_string_lossy(),
        masks.display()
    ))
}
