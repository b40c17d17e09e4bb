//! A look at the mask before it is used for a whole data set, by a few frames of the video.
//!
//! Frames and mask are looked at in a small size: an error of the mask that is worth a warning is a region that is wide.

use std::borrow::Cow;

use image::{GrayImage, ImageBuffer, Pixel, RgbImage};
use relit_data::shard::MaskMisfit;
use relit_grabcut::{
    Effort, MIN_SIDE, MaskCheck, MaskError, ShapeCheck, TurnFrames, TurnStatistics, half_image,
};
use relit_video::{Video, VideoError};

use super::ExtractError;
use super::object::LARGE;

/// Frames that are looked at.
const FRAMES: usize = 12;
/// Frames are halved until they have at most so many pixels.
const MAX_PIXELS: u64 = 310_000;

/// One sentence for each thing that is worth a warning about a mask, and how much the mask does not fit.
type MaskDoubts = (Vec<String>, Option<MaskMisfit>);

/// What is worth a warning about a mask; nothing if the video says nothing about it. `frame` is the one on which the
/// mask was made, if that is known: in others the object may lie elsewhere.
///
/// # Errors
/// [`ExtractError::Video`] or [`ExtractError::MaskDoubts`].
pub fn mask_doubts(
    video: &Video,
    mask: &GrayImage,
    frame: Option<u64>,
) -> Result<MaskDoubts, ExtractError> {
    let inside = mask.pixels().filter(|level| level.0 != [0]).count();
    if inside as f64 > LARGE * mask.len() as f64 {
        // Too little background is left to be compared with.
        return Ok(MaskDoubts::default());
    }
    let halvings = halvings(mask.dimensions());
    let small = halved(mask, halvings);
    let mut turn = TurnFrames::new(small.width(), small.height());
    let frame = collect(video, mask.dimensions(), halvings, frame, &mut turn)?;
    let statistics = TurnStatistics::new(&turn);
    let check = match MaskCheck::new(&small, &statistics) {
        Ok(check) => check,
        Err(MaskError::FewFrames { .. } | MaskError::Empty) => return Ok(MaskDoubts::default()),
        Err(error) => return Err(error.into()),
    };
    let Some(frame) = frame else {
        return Ok(MaskDoubts::default());
    };
    let shape = check.shape(&frame, Effort::Draft)?;
    let shape = shape.map(|shape| shape.enlarged(1 << halvings));
    Ok(shape.as_ref().map(doubts).unwrap_or_default())
}

/// Puts some frames, halved, into `turn`. Returns the one on which the mask was made, halved too: one in the middle if
/// that is not known.
fn collect(
    video: &Video,
    size: (u32, u32),
    halvings: u32,
    of_mask: Option<u64>,
    turn: &mut TurnFrames,
) -> Result<Option<RgbImage>, VideoError> {
    let numbers = video.quick_spread(FRAMES);
    let middle = numbers.get(numbers.len() / 2).copied();
    let of_mask = of_mask.and_then(|number| video.frame(number).ok());
    let mut shown = of_mask.map(|frame| halved(&frame, halvings).into_owned());
    for (number, picture) in video.pictures(&numbers, size)? {
        let picture = halved(&picture, halvings);
        turn.push(&picture);
        if shown.is_none() && Some(number) >= middle {
            shown = Some(picture.into_owned());
        }
    }
    Ok(shown)
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

fn doubts(shape: &ShapeCheck) -> MaskDoubts {
    let reasons = shape.faults_at_a_look();
    let misfit = match (reasons.is_empty(), shape.is_of_something_else()) {
        (true, _) => None,
        (false, false) => Some(MaskMisfit::InPart),
        (false, true) => Some(MaskMisfit::AsAWhole),
    };
    (reasons, misfit)
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
