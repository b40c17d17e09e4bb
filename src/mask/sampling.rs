//! What a turn shows, by frames spread over its video.

use relit_grabcut::{TURN_FRAMES, TurnFrames, TurnStatistics};
use relit_video::Video;

use super::MaskingError;
use super::request::TurnRequest;

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
        TurnRequest::Sampled => video.spread(TURN_FRAMES),
        TurnRequest::Frames(frames) => frames.clone(),
    };
    let mut frames = Vec::new();
    let mut turn = TurnFrames::new(width, height);
    for (number, picture) in video.pictures(&numbers, (width, height))? {
        frames.push(number);
        turn.push(&picture);
    }
    let statistics = TurnStatistics::new(&turn);
    Ok(Some(SampledTurn { frames, statistics }))
}
