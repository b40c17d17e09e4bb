//! A mask held against all frames of its recording: does the object stay under it, and is its shape right?

mod drift;
mod files;
mod page;
mod verdict;

use std::path::{Path, PathBuf};

use image::GrayImage;
use relit_data::mask::{MaskPicture, size_hint};
use relit_data::session::{MASK_FILE, Recording};
use relit_grabcut::{Effort, MaskCheck, Registration, ShapeCheck, TURN_FRAMES};
use relit_video::Video;
use serde::Serialize;

use super::files::{read_if_exists, write};
use super::sampling::sampled;
use super::{MaskFiles, MaskRecord, MaskingError};
use drift::{drifts, summary, worst};
use files::{check_files, record};
use verdict::verdict;

pub use drift::{DriftCheck, FrameDrift};
pub use verdict::MaskVerdict;

/// Everything that was found about a mask.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MaskReport {
    /// Whether it fits.
    pub verdict: MaskVerdict,
    /// Why not, one sentence each; empty if it fits.
    pub reasons: Vec<String>,
    /// Where the object is over the turn; none if it was found in no frame.
    pub drift: Option<DriftCheck>,
    /// The mask's shape; none if hardly anything moves in the video.
    pub shape: Option<ShapeCheck>,
}

/// A report that was written.
#[derive(Debug, Clone)]
pub struct CheckOutput {
    /// The recording's id.
    pub recording: String,
    /// The report.
    pub report: MaskReport,
    /// The page: `NAME-check.html` beside the mask, or `NAME-on-RECORDING-check.html` where the mask is not the
    /// recording's own.
    pub page: PathBuf,
}

/// Holds a recording's mask (`mask`, or else the one in the session folder) against all its frames, and
/// writes a page and a record about it beside the mask. `advanced` is called after each frame. Memory does not grow with the
/// video, except for a few bytes a frame.
///
/// # Errors
/// [`MaskingError::Session`] if there is no recording; otherwise [`MaskingError::Recording`] around the cause.
pub fn check_mask(
    input: &Path,
    mask: Option<&Path>,
    advanced: &dyn Fn(u64, u64),
) -> Result<CheckOutput, MaskingError> {
    let recording = Recording::open(input)?;
    let checked = check_recording(&recording, mask, advanced);
    let (report, page) = checked.map_err(MaskingError::of(&recording))?;
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
    let turn = sampled(&video, image.dimensions(), &video.spread(TURN_FRAMES))?;
    let check = MaskCheck::new(&image, &turn.statistics)?;
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
    let [page_file, record_file] = check_files(&files, recording);
    let record = record(&recording.id, &report, &png, &record_file)?;
    write(&page_file, page.as_bytes())?;
    write(&record_file, &record)?;
    Ok((report, page_file))
}

/// The picture of the mask, and its file.
fn read_mask(path: &Path) -> Result<(MaskPicture, Vec<u8>), MaskingError> {
    let bytes = std::fs::read(path).map_err(MaskingError::io(path, "read"))?;
    let image = relit_data::still::decode(&bytes);
    let image = image.map_err(|error| MaskingError::unusable("mask", path, &error))?;
    Ok((MaskPicture::of_image(&image), bytes))
}

/// What the mask marks: 255, and 0 elsewhere.
fn object_of(path: &Path, picture: &MaskPicture) -> Result<GrayImage, MaskingError> {
    let object = picture.object();
    let object =
        object.map_err(|fault| MaskingError::unusable("mask", path, &format!("it {fault}")))?;
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
    let why = format!(
        "it is {width} x {height} pixels and the frames are {} x {}{}",
        facts.width,
        facts.height,
        hint.map(|hint| format!("; {hint}")).unwrap_or_default()
    );
    Err(MaskingError::unusable("mask", path, &why))
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
