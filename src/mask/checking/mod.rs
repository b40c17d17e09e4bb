//! A mask held against all frames of its recording: does the object stay under it, and is its shape right?

mod drift;
mod files;
mod page;
mod report;
mod verdict;

use std::path::{Path, PathBuf};

use image::GrayImage;
use relit_data::mask::{MaskPicture, size_hint};
use relit_data::session::{MASK_FILE, Recording};
use relit_grabcut::{Effort, MaskCheck, Registration, TURN_FRAMES, TurnFrames, TurnStatistics};
use relit_video::Video;

use super::files::{read_if_exists, write};
use super::{MaskFiles, MaskRecord, MaskingError};
use drift::{drifts, summary, worst};
use files::{CheckFiles, record};
use verdict::verdict;

pub use drift::{DriftCheck, FrameDrift};
pub use report::{CheckOutput, MaskReport};
pub use verdict::MaskVerdict;

/// Holds a recording's mask (`mask`, or else the one in the session folder) against all its frames, and
/// writes a page and a record about it beside the mask. `advanced` is called after each frame. Memory does not grow with the
/// video, except for a few bytes a frame.
///
/// # Errors
/// [`MaskingError::Session`] if there is no recording; otherwise [`MaskingError::Checked`] around the cause.
pub fn check_mask(
    input: &Path,
    mask: Option<&Path>,
    advanced: &dyn Fn(u64, u64),
) -> Result<CheckOutput, MaskingError> {
    let recording = Recording::open(input)?;
    let checked = check_recording(&recording, mask, advanced);
    let (report, page) = checked.map_err(|source| MaskingError::Checked {
        recording: recording.id.clone(),
        source: Box::new(source),
    })?;
    Ok(CheckOutput {
        recording: recording.id,
        report,
        page,
    })
}

fn check_recording(
    recording: &Recording,
    mask: Option<&Path>,
    advanced: &dyn Fn(u64, u64),
) -> Result<(MaskReport, PathBuf), MaskingError> {
    let folder = recording.folder.clone().unwrap_or_default();
    let files = MaskFiles::of(&mask.map_or_else(|| folder.join(MASK_FILE), Path::to_owned))?;
    let (picture, png) = read_mask(&files.mask)?;
    let video = Video::open(&recording.video)?;
    check_size(&files.mask, picture.size(), &video)?;
    let image = object_of(&files.mask, &picture)?;
    let source = source_frame(&files, &video)?;
    let sampled = video.spread(TURN_FRAMES);
    let statistics = statistics(&video, image.dimensions(), &sampled)?;
    let check = MaskCheck::new(&image, &statistics)?;
    let frame = video.frame(source)?;
    let origin = check.register(&frame);
    let registered = register_all(&video, &check, image.dimensions(), advanced)?;
    let drifts = drifts(&registered, origin);
    let drift = summary(&drifts, video.frames().len());
    let shape = check.shape(&frame, Effort::Fine)?;
    let (verdict, reasons) = verdict(drift.as_ref(), shape.as_ref());
    let report = MaskReport {
        verdict,
        reasons,
        drift,
        shape,
    };
    let shown = worst(&drifts, source, video.frames().len());
    let page = page::page(&recording.id, &report, &drifts, &shown, &video, &image)?;
    let files = CheckFiles::of(&files, recording);
    let record = record(&recording.id, &report, &png, &files.record)?;
    write(&files.page, page.as_bytes())?;
    write(&files.record, &record)?;
    Ok((report, files.page))
}

/// The picture of the mask, and its file.
fn read_mask(path: &Path) -> Result<(MaskPicture, Vec<u8>), MaskingError> {
    let bytes = std::fs::read(path).map_err(MaskingError::io(path, "read"))?;
    let image = relit_still::decode(&bytes).map_err(|error| MaskingError::Check {
        path: path.to_owned(),
        why: format!("it {error}"),
    })?;
    Ok((MaskPicture::of_image(&image), bytes))
}

/// What the mask marks: 255, and 0 elsewhere.
fn object_of(path: &Path, picture: &MaskPicture) -> Result<GrayImage, MaskingError> {
    let object = picture.object().map_err(|fault| MaskingError::Check {
        path: path.to_owned(),
        why: format!("it {fault}"),
    })?;
    let levels = object.inside.iter().map(|&inside| u8::from(inside) * 255);
    let (width, height) = picture.size();
    Ok(GrayImage::from_raw(width, height, levels.collect()).unwrap_or_default())
}

fn check_size(path: &Path, mask: (u32, u32), video: &Video) -> Result<(), MaskingError> {
    let facts = video.facts();
    let (width, height) = mask;
    if (width, height) == (facts.width, facts.height) {
        return Ok(());
    }
    let hint = size_hint((width, height), (facts.width, facts.height));
    Err(MaskingError::Check {
        path: path.to_owned(),
        why: format!(
            "it is {width} x {height} pixels and the frames are {} x {}{}",
            facts.width,
            facts.height,
            hint.map(|hint| format!("; {hint}")).unwrap_or_default()
        ),
    })
}

/// The frame on which the mask was made, if its record says so and the video has it.
fn source_frame(files: &MaskFiles, video: &Video) -> Result<u64, MaskingError> {
    let record = read_if_exists(&files.record)?;
    let record = record.and_then(|bytes| MaskRecord::from_json(&bytes).ok());
    let frame = record.map_or(0, |record| record.source.frame);
    Ok(match usize::try_from(frame) {
        Ok(at) if at < video.frames().len() => frame,
        _ => 0,
    })
}

fn statistics(
    video: &Video,
    size: (u32, u32),
    frames: &[u64],
) -> Result<TurnStatistics, MaskingError> {
    let mut turn = TurnFrames::new(size.0, size.1);
    for picture in video.pictures(frames, size)? {
        turn.push(&picture.1);
    }
    Ok(TurnStatistics::new(&turn))
}

/// Where the object is in each frame in which it is found, in the order of the frames.
fn register_all(
    video: &Video,
    check: &MaskCheck<'_>,
    size: (u32, u32),
    advanced: &dyn Fn(u64, u64),
) -> Result<Vec<(u64, Registration)>, MaskingError> {
    let numbers = video.spread(usize::MAX);
    let all = numbers.len() as u64;
    let mut registered = Vec::new();
    for (done, (number, picture)) in video.pictures(&numbers, size)?.enumerate() {
        registered.extend(check.register(&picture).map(|found| (number, found)));
        advanced(done as u64 + 1, all);
    }
    registered.sort_by_key(|(number, _)| *number);
    Ok(registered)
}
