//! A mask held against what the turn of its recording shows: is its shape that of the object?

use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::RgbImage;
use image::codecs::jpeg::JpegEncoder;
use relit_data::causes::with_causes;
use relit_data::mask::VideoMask;
use relit_data::session::{MASK_FILE, Recording, mask_in, mask_stem};
use relit_grabcut::{Effort, MaskCheck, MaskError, ShapeCheck, TURN_FRAMES, preview};
use relit_video::Video;
use serde::Serialize;

use super::files::write;
use super::sampling::sampled;
use super::{MaskFiles, MaskingError};

/// The schema of the record.
const CHECK_SCHEMA: &str = "relit.mask-check/1";
/// JPEG quality of the frame on the page, 1 to 100.
const QUALITY: u8 = 85;

const STYLE: &str = "body{font:16px/1.4 system-ui,sans-serif;max-width:56rem;margin:1rem auto;padding:0 1rem;color:#1b1e24}\
h1{font-size:1.2rem}.verdict{font-weight:700}.fits{color:#13703a}.unknown{color:#96550a}.wrong{color:#b3261e}img{width:100%}";

/// Whether a mask fits its recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MaskVerdict {
    /// It does.
    Fits,
    /// Its shape is not that of the object.
    Wrong,
    /// Hardly anything moves in the video: it does not show what the object is.
    Unknown,
}

impl MaskVerdict {
    /// In a word, and in a sentence.
    #[must_use]
    pub const fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::Fits => ("fits", "the mask fits"),
            Self::Wrong => ("wrong", "the mask is not that of the object"),
            Self::Unknown => ("unknown", "the mask could not be judged"),
        }
    }
}

/// Everything that was found about a mask.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MaskReport {
    /// Whether it fits.
    pub verdict: MaskVerdict,
    /// Why not, one sentence each; empty if it fits.
    pub reasons: Vec<String>,
    /// The mask's shape; none if hardly anything moves in the video.
    pub shape: Option<ShapeCheck>,
}

impl MaskReport {
    fn from_shape(shape: Option<ShapeCheck>) -> Self {
        let (verdict, reasons) = match shape.as_ref().map(ShapeCheck::faults) {
            Some(faults) if faults.is_empty() => (MaskVerdict::Fits, faults),
            Some(faults) => (MaskVerdict::Wrong, faults),
            None => {
                let why = "hardly anything moves in the video, so that it does not show the object: check mask-preview.png";
                (MaskVerdict::Unknown, vec![why.to_owned()])
            }
        };
        Self {
            verdict,
            reasons,
            shape,
        }
    }
}

/// What the record of a check holds.
#[derive(Serialize)]
struct CheckRecord<'a> {
    schema: &'static str,
    recording: &'a str,
    /// BLAKE3 of the mask's file: the check of another mask says nothing about this one.
    mask_blake3: String,
    #[serde(flatten)]
    report: &'a MaskReport,
}

/// A report that was written.
#[derive(Debug, Clone)]
pub struct CheckOutput {
    /// The recording's id.
    pub recording: String,
    /// The report.
    pub report: MaskReport,
    /// The page: `NAME-check.html` in the session folder, or beside the mask where the recording is a bare video.
    pub page: PathBuf,
}

/// Holds a recording's mask (`mask`, that of its name in the folder `mask`, or else the one in the session folder) against what its turn shows, and
/// writes a page and a record about it.
///
/// # Errors
/// [`MaskingError::Session`] without a recording; otherwise what went wrong with it, which does not name it.
pub fn check_mask(input: &Path, mask: Option<&Path>) -> Result<CheckOutput, MaskingError> {
    let recording = Recording::open(input)?;
    let (report, page) = check_recording(&recording, mask)?;
    Ok(CheckOutput {
        recording: recording.id,
        report,
        page,
    })
}

fn check_recording(
    recording: &Recording,
    mask: Option<&Path>,
) -> Result<(MaskReport, PathBuf), MaskingError> {
    let files = MaskFiles::from_mask_path(&mask_of(recording, mask)?)?;
    let video = Video::open(&recording.video)?;
    let facts = video.facts();
    let mask = VideoMask::read(&files.mask, (facts.width, facts.height), facts.stored_size);
    let mask = mask.map_err(|fault| {
        let why = format!("it {}", with_causes(&fault));
        MaskingError::unusable("mask", &files.mask, &why)
    })?;
    let (image, frames) = (mask.image, video.frames().len() as u64);
    let made_on = mask.frame.filter(|&frame| frame < frames);
    let frame = video.frame(made_on.unwrap_or(0))?;
    let turn = sampled(&video, image.dimensions(), &video.spread(TURN_FRAMES))?;
    let check = MaskCheck::new(&image, &turn.statistics)?;
    let report = MaskReport::from_shape(check.shape(&frame, Effort::Fine)?);
    let page = page(&recording.id, &report, &preview(&frame, &image))?;
    let [page_file, record_file] = check_files(&files, recording);
    let record = record(&recording.id, &report, &mask.bytes, &record_file)?;
    write(&page_file, page.as_bytes())?;
    write(&record_file, &record)?;
    Ok((report, page_file))
}

/// The file of a recording's mask: `named`, that of its name in a folder `named`, or the one in its own folder.
fn mask_of(recording: &Recording, named: Option<&Path>) -> Result<PathBuf, MaskingError> {
    match named {
        Some(masks) if masks.is_dir() => mask_in(masks, recording).ok_or_else(|| {
            let named_after = recording.folder.as_deref().unwrap_or(&recording.video);
            let name = mask_stem(named_after);
            let what = format!("has no {}.png", name.to_string_lossy());
            MaskingError::Refused(format!("{} {what}: make it with -o", masks.display()))
        }),
        Some(file) => Ok(file.to_owned()),
        None => Ok(recording.folder.clone().unwrap_or_default().join(MASK_FILE)),
    }
}

/// The page and the record: `NAME-check.html` and `NAME-check.json` in the folder of a recorded session, so that one mask can be
/// held against several sessions, or beside the mask.
fn check_files(files: &MaskFiles, recording: &Recording) -> [PathBuf; 2] {
    ["-check.html", "-check.json"].map(|ending| {
        let mut name = files.mask.file_stem().unwrap_or_default().to_owned();
        name.push(ending);
        match &recording.folder {
            Some(folder) if recording.manifest.is_some() => folder.join(name),
            _ => files.mask.with_file_name(name),
        }
    })
}

/// The record of a check, as it is written; `png` is the mask's file.
fn record(
    recording: &str,
    report: &MaskReport,
    png: &[u8],
    path: &Path,
) -> Result<Vec<u8>, MaskingError> {
    let record = CheckRecord {
        schema: CHECK_SCHEMA,
        recording,
        mask_blake3: blake3::hash(png).to_hex().to_string(),
        report,
    };
    let json = serde_json::to_vec_pretty(&record);
    let mut bytes = json.map_err(|error| MaskingError::io(path, "written")(error.into()))?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// The page: verdict, reasons, and the mask on its frame. One file without scripts that loads nothing.
fn page(id: &str, report: &MaskReport, shown: &RgbImage) -> Result<String, MaskingError> {
    let (class, word) = report.verdict.words();
    let word = format!("{}{}", word[..1].to_uppercase(), &word[1..]);
    let id = escaped(id);
    let reasons: String = report
        .reasons
        .iter()
        .map(|reason| format!("<li>{}</li>", escaped(reason)))
        .collect();
    let mut jpeg = Vec::new();
    let what = "a frame";
    JpegEncoder::new_with_quality(&mut jpeg, QUALITY)
        .encode_image(shown)
        .map_err(|source| MaskError::Encode { what, source })?;
    Ok(format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\
        <title>The mask of {id}</title><style>{STYLE}</style></head><body>\n<h1>The mask of {id}</h1>\n\
        <p class=\"verdict {class}\">{word}.</p>\n<ul>{reasons}</ul>\n\
        <img alt=\"The mask's outline on its frame\" src=\"data:image/jpeg;base64,{}\"></body></html>\n",
        STANDARD.encode(jpeg)
    ))
}

fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;");
    text.replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;
    use relit_data::geometry::Rect;
    use relit_grabcut::DoubtfulRegion;

    fn shape() -> ShapeCheck {
        ShapeCheck {
            area_px: 10_000,
            outline: 0.8,
            outline_of_turn: 0.8,
            contradicted: false,
            leaks: Vec::new(),
            whiskers: Vec::new(),
            missing: Vec::new(),
        }
    }

    fn region(px: u64) -> Vec<DoubtfulRegion> {
        let bounds = Rect::new(1, 2, 30, 40);
        vec![DoubtfulRegion { px, bounds }]
    }

    #[test]
    fn each_verdict_has_its_reason() {
        let fits = MaskReport::from_shape(Some(shape()));
        assert_eq!((fits.verdict, fits.reasons.len()), (MaskVerdict::Fits, 0));
        let mut reasons = HashSet::new();
        for changed in [
            ShapeCheck {
                leaks: region(500),
                ..shape()
            },
            ShapeCheck {
                whiskers: region(60),
                ..shape()
            },
            ShapeCheck {
                missing: region(500),
                ..shape()
            },
            ShapeCheck {
                outline: 0.5,
                ..shape()
            },
        ] {
            let found = MaskReport::from_shape(Some(changed));
            assert_eq!(found.verdict, MaskVerdict::Wrong, "{:?}", found.reasons);
            assert_eq!(found.reasons.len(), 1, "{:?}", found.reasons);
            reasons.extend(found.reasons);
        }
        assert_eq!(reasons.len(), 4, "{reasons:?}");
        let unknown = MaskReport::from_shape(None);
        assert_eq!(
            (unknown.verdict, unknown.reasons.len()),
            (MaskVerdict::Unknown, 1)
        );
    }

    #[test]
    fn a_mask_that_follows_what_moves_better_than_the_turn_is_not_blamed_for_what_only_that_has() {
        let shape = ShapeCheck {
            outline: 0.9,
            missing: region(900),
            ..shape()
        };
        assert_eq!(
            MaskReport::from_shape(Some(shape)).verdict,
            MaskVerdict::Fits
        );
    }
}
