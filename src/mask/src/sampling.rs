//! Frames of a video: the one on which a mask is made, and those spread over it that tell what the turn shows.

use std::fs;

use image::RgbImage;
use relit_data::still::{Colour, is_named};
use relit_grabcut::{TURN_FRAMES, TurnFrames, TurnStatistics};
use relit_video::{Video, VideoError};

use super::request::TurnRequest;
use super::{MaskingError, SourceFrame};

/// The numbers of some frames of a turn, and what they tell.
#[derive(Debug)]
pub(super) struct SampledTurn {
    pub(super) frames: Vec<u64>,
    pub(super) statistics: TurnStatistics,
}

/// Reads the frames of a turn that are requested; none if one frame is enough, and none for a photograph.
pub(super) fn read_turn(
    video: &Video,
    size: (u32, u32),
    request: &TurnRequest,
) -> Result<Option<SampledTurn>, MaskingError> {
    match request {
        TurnRequest::None => Ok(None),
        TurnRequest::Sampled if is_photograph(video) => Ok(None),
        TurnRequest::Sampled => sampled(video, size, &video.spread(TURN_FRAMES)).map(Some),
        TurnRequest::Frames(frames) => sampled(video, size, frames).map(Some),
    }
}

/// Whether there is one picture and no turn.
pub(super) fn is_photograph(video: &Video) -> bool {
    video.frames().len() == 1
}

/// Reads these frames. Those that cannot be decoded are left out.
pub(super) fn sampled(
    video: &Video,
    (width, height): (u32, u32),
    numbers: &[u64],
) -> Result<SampledTurn, MaskingError> {
    let mut frames = Vec::new();
    let mut turn = TurnFrames::new(width, height);
    for (number, picture) in video.pictures(numbers, (width, height))? {
        frames.push(number);
        turn.push(&picture);
    }
    let statistics = TurnStatistics::new(&turn);
    Ok(SampledTurn { frames, statistics })
}

/// Reads a frame, and reports its recording.
pub(super) fn read_frame(
    video: &Video,
    number: u64,
) -> Result<(RgbImage, SourceFrame), MaskingError> {
    let mut frame = decoded(video, number)?;
    to_srgb(video, &mut frame)?;
    let info = video.frames().iter().find(|info| info.number == number);
    let name = video.path().file_name().unwrap_or_default();
    let source = SourceFrame {
        video: name.to_string_lossy().into_owned(),
        frame: number,
        t_us: info.map_or(0, |info| info.t_us),
        width: frame.width(),
        height: frame.height(),
        exif_orientation: video.facts().exif_orientation,
        colour_conversion: video.facts().colour_conversion.clone(),
        frame_blake3: blake3::hash(frame.as_raw()).to_hex().to_string(),
    };
    Ok((frame, source))
}

/// Decodes a frame; whoever has a photograph is not told of frames.
fn decoded(video: &Video, number: u64) -> Result<RgbImage, MaskingError> {
    video.frame(number).map_err(|error| match error {
        VideoError::Frame { path, fault, .. } if is_named(&path) => {
            let why = format!("{fault}; save it again as PNG or JPEG, or take another");
            MaskingError::unusable("photograph", path, &why)
        }
        error => error.into(),
    })
}

/// Turns a photograph into sRGB, whose file says that its colours are others.
fn to_srgb(video: &Video, frame: &mut RgbImage) -> Result<(), MaskingError> {
    if !is_photograph(video) {
        return Ok(());
    }
    let path = video.path();
    let bytes = fs::read(path).map_err(MaskingError::io(path, "read"))?;
    let colour = Colour::from_file(&bytes).map_err(|fault| {
        let why = format!("it {fault}; convert it to sRGB");
        MaskingError::unusable("photograph", path, &why)
    })?;
    colour.to_srgb8(frame);
    Ok(())
}

/// Whether two frames have the same pixels.
pub(super) fn same_image(a: &SourceFrame, b: &SourceFrame) -> bool {
    (a.width, a.height, &a.frame_blake3) == (b.width, b.height, &b.frame_blake3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_damaged_photograph_is_refused_as_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cup.jpg");
        let picture = RgbImage::from_fn(64, 48, |x, y| image::Rgb([x as u8, y as u8, 90]));
        picture.save(&path).unwrap();
        let bytes = fs::read(&path).unwrap();
        fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        let read = Video::open(&path).map(|video| read_frame(&video, 0));
        let what = match read {
            Ok(Err(MaskingError::Unusable { what, .. })) => what,
            other => panic!("{other:?}"),
        };
        assert_eq!(what, "photograph");
    }
}
