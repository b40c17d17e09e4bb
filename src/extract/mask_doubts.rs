//! A look at the mask before it is used for a whole data set, by a few frames of the video.

use image::GrayImage;
use relit_data::shard::MaskMisfit;
use relit_grabcut::{Effort, MaskCheck, MaskError, ShapeCheck, TurnFrames, TurnStatistics};
use relit_video::Video;

use super::ExtractError;

/// Frames that are looked at.
const FRAMES: usize = 12;

/// What is worth a warning about a mask.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct MaskDoubts {
    /// One sentence each; none if the mask fits, or the video says nothing about it.
    pub reasons: Vec<String>,
    /// How much it does not fit; `None` without a reason.
    pub misfit: Option<MaskMisfit>,
}

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
    let numbers = video.quick_spread(FRAMES);
    let size = mask.dimensions();
    let mut turn = TurnFrames::new(size.0, size.1);
    for (_, picture) in video.pictures(&numbers, size)? {
        turn.push(&picture);
    }
    let statistics = TurnStatistics::new(&turn);
    let check = match MaskCheck::new(mask, &statistics) {
        Ok(check) => check,
        Err(MaskError::FewFrames { .. } | MaskError::Empty) => return Ok(MaskDoubts::default()),
        Err(error) => return Err(error.into()),
    };
    let of_mask = frame.and_then(|number| video.frame(number).ok());
    let frame = match (of_mask, numbers.get(numbers.len() / 2)) {
        (Some(frame), _) => frame,
        (None, Some(&middle)) => video.frame(middle)?,
        (None, None) => return Ok(MaskDoubts::default()),
    };
    // What is a region is wide: an edge that is blocky in a large frame changes none.
    let shape = check.shape(&frame, Effort::Draft)?;
    Ok(shape.as_ref().map(doubts).unwrap_or_default())
}

fn doubts(shape: &ShapeCheck) -> MaskDoubts {
    let reasons = shape.faults_at_a_look();
    let misfit = match (reasons.is_empty(), shape.is_of_something_else()) {
        (true, _) => None,
        (false, false) => Some(MaskMisfit::InPart),
        (false, true) => Some(MaskMisfit::AsAWhole),
    };
    MaskDoubts { reasons, misfit }
}
