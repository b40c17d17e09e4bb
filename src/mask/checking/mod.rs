//! A mask held against all frames of its recording: does the object stay under it, and is its shape right?

mod page;
mod verdict;

use std::path::{Path, PathBuf};

use image::{GrayImage, RgbImage};
use relit_data::geometry::Rect;
use relit_data::session::{MASK_FILE, Recording};
use relit_grabcut::{Effort, MaskCheck, Place, ShapeCheck, TURN_FRAMES, Turn, TurnStatistics};
use relit_video::Video;
use serde::Serialize;

use super::files::{read_if_exists, write};
use super::{MaskFiles, MaskRecord, MaskingError};
pub use verdict::Verdict;
use verdict::verdict;

/// A frame whose likeness is less than this share of the median says nothing about the object's place.
const LEAST_LIKENESS: f32 = 0.4;
/// Frames that the page shows.
const SHOWN: usize = 6;
/// Frames shown are at least so far apart, as a share of the video.
const APART: f64 = 0.02;

/// Where the object is in a frame, against the mask.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FrameDrift {
    /// The frame's number.
    pub frame: u64,
    /// To the right, pixels.
    pub dx: f32,
    /// Down, pixels.
    pub dy: f32,
}

impl FrameDrift {
    /// How far, pixels.
    #[must_use]
    pub fn px(&self) -> f32 {
        self.dx.hypot(self.dy)
    }
}

/// How far the object lies beside the mask over the turn.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DriftCheck {
    /// The median, pixels.
    pub median_px: f32,
    /// What 95 % of the frames stay below, pixels.
    pub p95_px: f32,
    /// The frame with the largest one.
    pub most: FrameDrift,
    /// Frames in which the object was found.
    pub frames: usize,
    /// Frames that were lost, or in which it was not found.
    pub unsure: usize,
}

/// Everything that was found about a mask.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MaskReport {
    /// Whether it fits.
    pub verdict: Verdict,
    /// Why not, one sentence each; empty if it fits.
    pub reasons: Vec<String>,
    /// The object's place over the turn; none if it was found in no frame.
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
    /// The page: `NAME-check.html` beside the mask.
    pub page: PathBuf,
}

/// Holds a recording's mask (`mask`, or else the one in the session folder) against all its frames, and
/// writes a page about it beside the mask. `advanced` is called after each frame. Memory does not grow with the
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
    let image = read_mask(&files.mask)?;
    let video = Video::open(&recording.video)?;
    check_size(&files.mask, &image, &video)?;
    if image.pixels().all(|pixel| pixel.0[0] < 128) {
        return Err(MaskingError::Check {
            path: files.mask.clone(),
            why: "it is empty: no pixel is white".to_owned(),
        });
    }
    let source = source_frame(&files, &video)?;
    let sampled = video.spread(TURN_FRAMES);
    let statistics = statistics(&video, image.dimensions(), &sampled)?;
    let check = MaskCheck::new(&image, &statistics)?;
    let frame = video.frame(source)?;
    let origin = check.place(&frame);
    let places = places(&video, &check, image.dimensions(), advanced)?;
    let drifts = drifts(&places, origin);
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
    let path = page::path(&files);
    write(&path, page.as_bytes())?;
    Ok((report, path))
}

fn read_mask(path: &Path) -> Result<GrayImage, MaskingError> {
    let bytes = std::fs::read(path).map_err(MaskingError::io(path, "read"))?;
    let image = image::load_from_memory(&bytes).map_err(|error| MaskingError::Check {
        path: path.to_owned(),
        why: error.to_string(),
    })?;
    Ok(image.into_luma8())
}

fn check_size(path: &Path, mask: &GrayImage, video: &Video) -> Result<(), MaskingError> {
    let facts = video.facts();
    let (width, height) = mask.dimensions();
    if (width, height) == (facts.width, facts.height) {
        return Ok(());
    }
    Err(MaskingError::Check {
        path: path.to_owned(),
        why: format!(
            "it is {width} x {height} pixels and the frames are {} x {}",
            facts.width, facts.height
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
    let mut turn = Turn::new(size.0, size.1);
    for picture in video.pictures(frames, size)? {
        turn.push(&picture.1);
    }
    Ok(TurnStatistics::new(&turn))
}

fn places(
    video: &Video,
    check: &MaskCheck<'_>,
    size: (u32, u32),
    advanced: &dyn Fn(u64, u64),
) -> Result<Vec<(u64, Place)>, MaskingError> {
    let numbers = video.spread(usize::MAX);
    let all = numbers.len() as u64;
    let mut places = Vec::new();
    for (done, (number, picture)) in video.pictures(&numbers, size)?.enumerate() {
        places.extend(check.place(&picture).map(|place| (number, place)));
        advanced(done as u64 + 1, all);
    }
    places.sort_by_key(|place| place.0);
    Ok(places)
}

/// The places against that of the mask's frame, or their median where that is not known; without those that
/// are unsure.
fn drifts(places: &[(u64, Place)], origin: Option<Place>) -> Vec<FrameDrift> {
    let of = |value: fn(&Place) -> f32| median(places.iter().map(|(_, place)| value(place)));
    let least = LEAST_LIKENESS * of(|place| place.likeness);
    let [x, y] = match origin.filter(|origin| origin.likeness >= least) {
        Some(origin) => origin.shift,
        None => [of(|place| place.shift[0]), of(|place| place.shift[1])],
    };
    let sure = places.iter().filter(|(_, place)| place.likeness >= least);
    sure.map(|&(frame, place)| FrameDrift {
        frame,
        dx: place.shift[0] - x,
        dy: place.shift[1] - y,
    })
    .collect()
}

fn median(values: impl Iterator<Item = f32>) -> f32 {
    at_share(values.collect(), 0.5)
}

fn at_share(mut values: Vec<f32>, share: f64) -> f32 {
    values.sort_by(f32::total_cmp);
    let at = (values.len() as f64 * share) as usize;
    values.get(at).or(values.last()).copied().unwrap_or(0.0)
}

fn summary(drifts: &[FrameDrift], frames: usize) -> Option<DriftCheck> {
    let px = || drifts.iter().map(FrameDrift::px).collect();
    let most = drifts.iter().max_by(|a, b| a.px().total_cmp(&b.px()))?;
    Some(DriftCheck {
        median_px: at_share(px(), 0.5),
        p95_px: at_share(px(), 0.95),
        most: *most,
        frames: drifts.len(),
        unsure: frames.saturating_sub(drifts.len()),
    })
}

/// The mask's own frame, and those with the largest drifts, some way apart.
fn worst(drifts: &[FrameDrift], source: u64, frames: usize) -> Vec<u64> {
    let mut sorted: Vec<&FrameDrift> = drifts.iter().collect();
    sorted.sort_by(|a, b| b.px().total_cmp(&a.px()));
    let apart = (frames as f64 * APART) as u64;
    let mut shown = vec![source];
    for drift in sorted {
        let near = |&other: &u64| other.abs_diff(drift.frame) <= apart;
        if shown.len() < SHOWN && !shown.iter().any(near) {
            shown.push(drift.frame);
        }
    }
    shown
}

/// The object's bounds with some space around, inside the frame.
fn surroundings(mask: &GrayImage) -> Rect {
    let (width, height) = mask.dimensions();
    let inside = mask.enumerate_pixels().filter(|(.., p)| p.0[0] >= 128);
    let (mut low, mut high) = ((width, height), (0, 0));
    for (x, y, _) in inside {
        low = (low.0.min(x), low.1.min(y));
        high = (high.0.max(x), high.1.max(y));
    }
    let space = (width.max(height) / 30).max(4);
    let (left, top) = (low.0.saturating_sub(space), low.1.saturating_sub(space));
    let right = (high.0 + space + 1).min(width).max(left + 1);
    let bottom = (high.1 + space + 1).min(height).max(top + 1);
    Rect::new(left as i32, top as i32, right - left, bottom - top)
}

fn cropped(image: &RgbImage, part: Rect) -> RgbImage {
    let (x, y) = (part.x.unsigned_abs(), part.y.unsigned_abs());
    image::imageops::crop_imm(image, x, y, part.w, part.h).to_image()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(frame: u64, dx: f32, likeness: f32) -> (u64, Place) {
        let shift = [dx, 0.0];
        (frame, Place { shift, likeness })
    }

    #[test]
    fn drift_is_measured_from_the_masks_frame_and_unsure_frames_are_left_out() {
        let places = [
            place(0, 1.0, 0.5),
            place(1, 2.0, 0.5),
            place(2, -5.0, 0.1),
            place(3, 4.0, 0.6),
        ];
        let found = drifts(&places, Some(places[0].1));
        let dx: Vec<f32> = found.iter().map(|drift| drift.dx).collect();
        assert_eq!(dx, [0.0, 1.0, 3.0]);
        let summary = summary(&found, 4).unwrap();
        assert_eq!((summary.most.frame, summary.unsure), (3, 1));
        assert_eq!(summary.median_px, 1.0);
        assert_eq!(summary.most.px(), 3.0);
    }

    #[test]
    fn the_worst_frames_are_some_way_apart() {
        let drifts: Vec<FrameDrift> = (0..1000)
            .map(|frame| FrameDrift {
                frame,
                dx: if frame / 100 == 5 { 3.0 } else { 0.1 },
                dy: 0.0,
            })
            .collect();
        let shown = worst(&drifts, 0, 1000);
        assert_eq!(shown.len(), SHOWN);
        assert_eq!(shown[..2], [0, 500]);
        assert!(shown[2] > 520);
    }
}
