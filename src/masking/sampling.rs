//! Frames of a turn, spread over a video.

use image::RgbImage;
use relit_data::geometry::Rect;
use relit_mask::{TURN_FRAMES, Turn, TurnStatistics};
use relit_video::Video;

use super::MaskingError;
use super::request::TurnRequest;

/// Threads that decode ahead where frames depend on each other.
const DECODERS: usize = 2;

/// The numbers of some frames of a turn, and what they tell.
#[derive(Debug)]
pub(super) struct SampledTurn {
    pub(super) frames: Vec<u64>,
    pub(super) statistics: TurnStatistics,
}

/// Reads the frames that are asked for; none where one frame is enough. Frames that cannot be decoded
/// are left out.
pub(super) fn read_turn(
    video: &Video,
    (width, height): (u32, u32),
    request: &TurnRequest,
) -> Result<Option<SampledTurn>, MaskingError> {
    let numbers = match request {
        TurnRequest::None => return Ok(None),
        TurnRequest::Sampled => spread(video, TURN_FRAMES),
        TurnRequest::Frames(frames) => frames.clone(),
    };
    let mut frames = Vec::new();
    let mut turn = Turn::new(width, height);
    for (number, picture) in pictures(video, &numbers, (width, height))? {
        frames.push(number);
        turn.push(&picture);
    }
    let statistics = TurnStatistics::new(&turn);
    Ok(Some(SampledTurn { frames, statistics }))
}

/// Reads frames one after the other. Those that cannot be decoded, or have another size, are left out.
pub(super) fn pictures<'a>(
    video: &'a Video,
    numbers: &[u64],
    (width, height): (u32, u32),
) -> Result<impl Iterator<Item = (u64, RgbImage)> + use<'a>, MaskingError> {
    let whole = Rect::new(0, 0, width, height);
    let pending = video.read(numbers, DECODERS)?;
    Ok(pending.filter_map(move |pending| {
        let picture = video.picture(pending).ok()?;
        if picture.size() != (width, height) {
            return None;
        }
        Some((picture.number(), picture.rgb(whole).ok()?))
    }))
}

/// Up to `count` frames of the video at equal distances, without those that are known to be damaged.
pub(super) fn spread(video: &Video, count: usize) -> Vec<u64> {
    let whole: Vec<u64> = video
        .frames()
        .iter()
        .filter(|frame| !frame.damaged)
        .map(|frame| frame.number)
        .collect();
    evenly(&whole, count)
}

/// Up to `count` of these at equal distances.
pub(super) fn evenly(frames: &[u64], count: usize) -> Vec<u64> {
    let count = count.min(frames.len());
    (0..count)
        .map(|step| frames[(2 * step + 1) * frames.len() / (2 * count)])
        .collect()
}
