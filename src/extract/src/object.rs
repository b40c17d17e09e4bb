//! The mask of the object, read from a file.

use std::path::Path;

use image::GrayImage;
use image::imageops::{FilterType, resize};

use relit_data::causes::with_causes;
use relit_data::geometry::Rect;
use relit_data::mask::{MaskPicture, bounding_box, size_hint};
use relit_data::session::{MASK_FILE, Recording, mask_in, mask_stem};
use relit_data::shard::Digest;
use relit_data::still;

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
        let bytes = std::fs::read(&path).map_err(ExtractError::io("read", &path))?;
        let of_this_mask =
            |what: String| ExtractError::Refused(format!("the mask {} {what}", path.display()));
        let picture = still::decode(&bytes).map_err(|error| of_this_mask(with_causes(&error)))?;
        let picture = MaskPicture::from_image(&picture);
        let size = picture.size();
        if size != frame && size != stored {
            let hint = size_hint(size, frame).unwrap_or("make the mask on a frame of this video");
            return Err(of_this_mask(format!(
                "is {} x {} pixels and the frames are {} x {}: {hint}",
                size.0, size.1, frame.0, frame.1
            )));
        }
        let object = picture
            .object()
            .map_err(|fault| of_this_mask(fault.to_string()))?;
        let levels = object
            .inside
            .iter()
            .map(|&inside| if inside { 255 } else { 0 });
        let mut image = GrayImage::from_raw(size.0, size.1, levels.collect()).unwrap_or_default();
        if size != frame {
            image = resize(&image, frame.0, frame.1, FilterType::Triangle);
            for level in image.iter_mut() {
                *level = if *level < 128 { 0 } else { 255 };
            }
        }
        let blake3 = Digest::hash(&bytes);
        let note = object
            .note(size.0)
            .map(|note| format!("the mask {} {note}", path.display()));
        Ok(Self {
            bounding_box: bounding_box(&image).unwrap_or_else(|| Rect::new(0, 0, frame.0, frame.1)),
            frame: frame_of(&path, &blake3),
            image,
            blake3,
            note,
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

/// The frame on which a mask was made, by its record (`mask.json` of `mask.png`). A record that is
/// damaged, or that of another mask, says nothing.
fn frame_of(mask: &Path, blake3: &Digest) -> Option<u64> {
    let record = std::fs::read(mask.with_extension("json")).ok()?;
    let record: serde_json::Value = serde_json::from_slice(&record).ok()?;
    let of_this_mask = record["result"]["mask_blake3"].as_str()? == blake3.to_string();
    record["source"]["frame"].as_u64().filter(|_| of_this_mask)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frame_of_a_mask_is_read_from_its_own_record_only() {
        let folder = tempfile::tempdir().unwrap();
        let mask = folder.path().join("m.png");
        let blake3 = Digest::hash(b"mask");
        assert_eq!(frame_of(&mask, &blake3), None);
        let record =
            format!(r#"{{"source": {{"frame": 7}}, "result": {{"mask_blake3": "{blake3}"}}}}"#);
        std::fs::write(mask.with_extension("json"), record).unwrap();
        assert_eq!(frame_of(&mask, &blake3), Some(7));
        assert_eq!(frame_of(&mask, &Digest::hash(b"another")), None);
    }
}
