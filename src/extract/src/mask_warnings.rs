//! A look at the mask before it is used for a whole data set, by a few frames of the video.
//!
//! Frames and mask are looked at in a small size: an error of the mask that is worth a warning is a region that is wide.

use std::borrow::Cow;

use image::{GrayImage, ImageBuffer, Pixel, RgbImage};
use relit_data::shard::MaskMisfit;
use relit_grabcut::{
    Effort, MIN_SIDE, MaskCheck, MaskError, ShapeCheck, TURN_FRAMES, TurnFrames, TurnStatistics,
    half_image,
};
use relit_video::{Video, VideoError};

use super::ExtractError;
use super::object::LARGE;

/// Frames of the first look.
const FRAMES: usize = 12;
/// Frames are halved until they have at most so many pixels.
const MAX_PIXELS: u64 = 310_000;
/// A mask is that of something else where its outline follows what moves less than so well, compared with the turn's
/// own, and so much of its area is wrong.
const OTHER_OUTLINE: f32 = 0.6;
const OTHER_AREA: f64 = 0.15;

/// One sentence for each thing that is worth a warning about a mask, and how much the mask does not fit.
type MaskWarnings = (Vec<String>, Option<MaskMisfit>);

/// What is worth a warning about a mask; nothing if the video says nothing about it. `frame` is the one on which the
/// mask was made, if that is known: in others the object may lie elsewhere.
///
/// The first look takes a few frames. What it finds may be a shadow: then all the frames decide with which the check
/// of relit-mask decides.
///
/// # Errors
/// [`ExtractError::Video`] or [`ExtractError::MaskWarnings`].
pub fn mask_warnings(
    video: &Video,
    mask: &GrayImage,
    frame: Option<u64>,
) -> Result<MaskWarnings, ExtractError> {
    let inside = mask.pixels().filter(|level| level.0 != [0]).count();
    if inside as f64 > LARGE * mask.len() as f64 {
        // Too little background is left to be compared with.
        return Ok(MaskWarnings::default());
    }
    let look = MaskComparison {
        video,
        mask,
        frame,
        halvings: halvings(mask.dimensions()),
    };
    let first = look.shape(&video.spread_key_frames(FRAMES), Effort::Draft)?;
    if first.is_none_or(|shape| shape.quick_faults().is_empty()) {
        return Ok(MaskWarnings::default());
    }
    let shape = look.shape(&video.spread(TURN_FRAMES), Effort::Fine)?;
    Ok(shape.as_ref().map(warnings).unwrap_or_default())
}

/// A mask that is held against some frames of its video.
struct MaskComparison<'a> {
    video: &'a Video,
    mask: &'a GrayImage,
    /// The frame on which the mask was made, if that is known.
    frame: Option<u64>,
    halvings: u32,
}

impl MaskComparison<'_> {
    /// The mask's shape against that which frames of these numbers show; `None` if they say nothing about it.
    fn shape(&self, numbers: &[u64], effort: Effort) -> Result<Option<ShapeCheck>, ExtractError> {
        let small = halved(self.mask, self.halvings);
        let mut turn = TurnFrames::new(small.width(), small.height());
        let frame = self.collect(numbers, &mut turn)?;
        let statistics = TurnStatistics::new(&turn);
        let check = match MaskCheck::new(&small, &statistics) {
            Ok(check) => check,
            Err(MaskError::FewFrames { .. } | MaskError::Empty) => return Ok(None),
            Err(error) => return Err(error.into()),
        };
        let Some(frame) = frame else {
            return Ok(None);
        };
        let shape = check.shape(&frame, effort)?;
        Ok(shape.map(|shape| shape.enlarged(1 << self.halvings)))
    }

    /// Puts frames, halved, into `turn`. Returns the one on which the mask was made, halved too: one in the middle if
    /// that is not known.
    fn collect(
        &self,
        numbers: &[u64],
        turn: &mut TurnFrames,
    ) -> Result<Option<RgbImage>, VideoError> {
        let middle = numbers.get(numbers.len() / 2).copied();
        let of_mask = self.frame.and_then(|number| self.video.frame(number).ok());
        let mut shown = of_mask.map(|frame| halved(&frame, self.halvings).into_owned());
        for (number, picture) in self.video.pictures(numbers, self.mask.dimensions())? {
            let picture = halved(&picture, self.halvings);
            turn.push(&picture);
            if shown.is_none() && Some(number) >= middle {
                shown = Some(picture.into_owned());
            }
        }
        Ok(shown)
    }
}

/// How often a frame of this size is halved.
fn halvings((width, height): (u32, u32)) -> u32 {
    let too_large = |by: &u32| {
        let (width, height) = (width >> by, height >> by);
        let pixels = u64::from(width) * u64::from(height);
        pixels > MAX_PIXELS && width.min(height) >= 2 * MIN_SIDE
    };
    (0..).take_while(too_large).count() as u32
}

fn halved<P: Pixel<Subpixel = u8>>(
    image: &ImageBuffer<P, Vec<u8>>,
    halvings: u32,
) -> Cow<'_, ImageBuffer<P, Vec<u8>>> {
    (0..halvings).fold(Cow::Borrowed(image), |image, _| {
        Cow::Owned(half_image(&image))
    })
}

fn warnings(shape: &ShapeCheck) -> MaskWarnings {
    let reasons = shape.faults();
    let misfit = match (reasons.is_empty(), is_of_another_object(shape)) {
        (true, _) => None,
        (false, false) => Some(MaskMisfit::InPart),
        (false, true) => Some(MaskMisfit::AsAWhole),
    };
    (reasons, misfit)
}

fn is_of_another_object(shape: &ShapeCheck) -> bool {
    let regions = [&shape.leaks, &shape.missing];
    let wrong_px: u64 = regions.into_iter().flatten().map(|region| region.px).sum();
    let has_other_outline = shape.outline < OTHER_OUTLINE * shape.outline_of_turn;
    let has_other_area = wrong_px as f64 > OTHER_AREA * shape.area_px as f64;
    shape.is_of_another_object() || (has_other_outline && has_other_area)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_frames_are_halved_and_small_ones_stay() {
        let cases = [
            ((640, 480), 0),
            ((1280, 720), 1),
            ((1920, 1080), 2),
            ((3840, 2160), 3),
            // Too low to be halved.
            ((100_000, MIN_SIDE), 0),
        ];
        for (size, halvings_of_it) in cases {
            assert_eq!(halvings(size), halvings_of_it, "{size:?}");
        }
    }

    #[test]
    fn a_halved_mask_has_the_mean_and_repeats_an_odd_edge() {
        let mask = GrayImage::from_raw(3, 3, vec![0, 255, 8, 255, 255, 8, 4, 8, 255]);
        let half = halved(&mask.unwrap_or_default(), 1).into_owned();
        assert_eq!(half.as_raw(), &[191, 8, 6, 255]);
    }
}
