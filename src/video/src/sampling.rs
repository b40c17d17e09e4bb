//! Some frames of a video, spread over it, as whole pictures.

use image::RgbImage;
use relit_data::geometry::Rect;

use super::{Video, VideoError};

/// Threads that decode ahead where frames depend on each other.
const DECODERS: usize = 2;

impl Video {
    /// Up to `count` frames at equal distances, without those that are known to be damaged.
    pub fn spread(&self, count: usize) -> Vec<u64> {
        let whole = self.frames().iter().filter(|frame| !frame.damaged);
        let whole: Vec<u64> = whole.map(|frame| frame.number).collect();
        evenly(&whole, count)
    }

    /// As [`Self::spread`], of key frames, which are decoded alone, where there are enough.
    pub fn spread_key_frames(&self, count: usize) -> Vec<u64> {
        let damaged = |&number: &u64| {
            let at = usize::try_from(number).unwrap_or(usize::MAX);
            self.frames().get(at).is_none_or(|frame| frame.damaged)
        };
        let keys = self.key_frames().iter().copied();
        let keys: Vec<u64> = keys.filter(|number| !damaged(number)).collect();
        if keys.len() < count {
            self.spread(count)
        } else {
            evenly(&keys, count)
        }
    }

    /// Reads frames one after the other, with their numbers. Those that cannot be decoded, or have another
    /// size, are left out.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn pictures(
        &self,
        numbers: &[u64],
        (width, height): (u32, u32),
    ) -> Result<impl Iterator<Item = (u64, RgbImage)> + use<'_>, VideoError> {
        let whole = Rect::new(0, 0, width, height);
        let pending = self.read(numbers, DECODERS)?;
        Ok(pending.filter_map(move |pending| {
            let picture = self.picture(pending).ok()?;
            if picture.size() != (width, height) {
                return None;
            }
            Some((picture.number(), picture.rgb(whole).ok()?))
        }))
    }
}

/// Up to `count` of these at equal distances.
fn evenly(frames: &[u64], count: usize) -> Vec<u64> {
    let count = count.min(frames.len());
    (0..count)
        .map(|step| frames[(2 * step + 1) * frames.len() / (2 * count)])
        .collect()
}
