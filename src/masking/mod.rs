//! The mask of a recording: reads one frame and writes three files.
//!
//! `NAME.png` is the mask, `NAME.json` its record, `NAME-preview.png` the image for checking it, and on
//! request `NAME-alpha.png` (`alpha.png` beside `mask.png`) its soft form. An
//! existing mask is replaced only if its record has its hash, because then it can be made again.
//!
//! This module brings frames and folders to `relit-mask`. It knows nothing of data sets and the rig.

mod bench;
mod error;
mod sampling;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use image::RgbImage;

use relit_data::durable;
use relit_data::session::{MASK_FILE, Notice, Recording};
use relit_mask::{
    Hints, MASK_SCHEMA, Mask, MaskError, MaskRecord, MaskSoftware, RecordFault, RecordedHints,
    RecordedResult, SegmentSettings, SourceFrame, Warning, alpha, grey_png, preview, rgb_png,
    segment, segment_turn,
};
use relit_video::Video;

pub use bench::{BenchImage, BenchRow, Prompt, bench_image, bench_images};
pub use error::MaskingError;
use sampling::read_turn;

/// How to make a mask.
#[derive(Debug, Clone)]
pub struct MaskRequest {
    frame: u64,
    hints: Option<Hints>,
    turn: TurnRequest,
    settings: SegmentSettings,
    recipe: Option<Recipe>,
    force: bool,
}

/// Which frames of the turn are looked at.
#[derive(Debug, Clone, PartialEq, Eq)]
enum TurnRequest {
    /// None but the one on which the mask is made.
    None,
    /// Some, spread over the video.
    Sampled,
    /// These.
    Frames(Vec<u64>),
}

/// A record whose mask has to be reproduced byte for byte.
#[derive(Debug, Clone)]
struct Recipe {
    path: PathBuf,
    record: MaskRecord,
}

/// A mask that was written.
#[derive(Debug, Clone)]
pub struct MaskOutput {
    /// The recording's id.
    pub recording: String,
    /// The three files.
    pub files: MaskFiles,
    /// The record.
    pub record: MaskRecord,
    /// What the user should know about the recording.
    pub notices: Vec<Notice>,
}

/// The paths of a mask's three files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MaskFiles {
    /// The mask.
    pub mask: PathBuf,
    /// Its record.
    pub record: PathBuf,
    /// The preview.
    pub preview: PathBuf,
    /// The share of the object in each pixel; written only if the settings ask for it.
    pub alpha: PathBuf,
}

impl MaskRequest {
    /// A mask on frame number `frame`, 0-based, with these hints.
    #[must_use]
    pub fn new(frame: u64, hints: Hints, settings: SegmentSettings) -> Self {
        Self {
            frame,
            hints: Some(hints),
            turn: TurnRequest::None,
            settings,
            recipe: None,
            force: false,
        }
    }

    /// A mask by what the whole video tells, on frame number `frame`, with or without hints.
    #[must_use]
    pub fn auto(frame: u64, hints: Option<Hints>, settings: SegmentSettings) -> Self {
        Self {
            frame,
            hints,
            turn: TurnRequest::Sampled,
            settings,
            recipe: None,
            force: false,
        }
    }

    /// The mask that the record `path` describes, to the same bytes.
    ///
    /// # Errors
    /// [`MaskingError::Io`] or [`MaskingError::Recipe`].
    pub fn from_recipe(path: &Path) -> Result<Self, MaskingError> {
        let wrong = |fault: RecordFault| MaskingError::Recipe {
            path: path.to_owned(),
            why: fault.to_string(),
        };
        let bytes = fs::read(path).map_err(MaskingError::io(path, "read"))?;
        let record = MaskRecord::from_json(&bytes).map_err(wrong)?;
        let hints = record.hints.hints().map_err(wrong)?;
        let path = path.to_owned();
        Ok(Self {
            frame: record.source.frame,
            hints,
            turn: match record.hints.turn_frames.as_slice() {
                [] => TurnRequest::None,
                frames => TurnRequest::Frames(frames.to_vec()),
            },
            settings: record.settings,
            recipe: Some(Recipe { path, record }),
            force: false,
        })
    }

    /// With `force`, replaces a mask that differs from its record, and accepts another result of a
    /// recipe.
    #[must_use]
    pub fn with_force(self, force: bool) -> Self {
        Self { force, ..self }
    }
}

impl MaskFiles {
    /// The files of the mask `mask`, whose name must end in `.png`.
    ///
    /// # Errors
    /// [`MaskingError::OutputName`].
    pub fn of(mask: &Path) -> Result<Self, MaskingError> {
        let is_png = mask
            .extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("png"));
        match mask.file_stem() {
            Some(stem) if is_png => {
                let mut preview = stem.to_owned();
                preview.push("-preview.png");
                let mut alpha = stem.to_owned();
                alpha.push("-alpha.png");
                if stem == "mask" {
                    alpha = "alpha.png".into();
                }
                Ok(Self {
                    mask: mask.to_owned(),
                    record: mask.with_extension("json"),
                    preview: mask.with_file_name(preview),
                    alpha: mask.with_file_name(alpha),
                })
            }
            _ => Err(MaskingError::OutputName(mask.to_owned())),
        }
    }
}

/// Makes the mask of the recording at `input`, a session folder or a video file, and writes its
/// files: to `output`, or else as `mask.png` into the session folder or, for a bare video, into the
/// working directory. Each file appears whole or not at all, the mask last; nothing is written if
/// anything before fails.
///
/// # Errors
/// [`MaskingError::Session`] if there is no recording; otherwise [`MaskingError::Recording`] around the cause.
pub fn make_mask(
    input: &Path,
    output: Option<MaskFiles>,
    request: &MaskRequest,
) -> Result<MaskOutput, MaskingError> {
    let recording = Recording::open(input)?;
    match mask_recording(&recording, output, request) {
        Ok((files, record)) => Ok(MaskOutput {
            recording: recording.id,
            files,
            record,
            notices: recording.notices,
        }),
        Err(source) => Err(MaskingError::Recording {
            recording: recording.id,
            source: Box::new(source),
        }),
    }
}

fn mask_recording(
    recording: &Recording,
    output: Option<MaskFiles>,
    request: &MaskRequest,
) -> Result<(MaskFiles, MaskRecord), MaskingError> {
    let files = match output {
        Some(files) => files,
        None => MaskFiles::of(&recording.folder.clone().unwrap_or_default().join(MASK_FILE))?,
    };
    check_replaceable(&files, request.force)?;
    let record = segment_and_write(&recording.video, &files, request)?;
    Ok((files, record))
}

fn segment_and_write(
    video: &Path,
    files: &MaskFiles,
    request: &MaskRequest,
) -> Result<MaskRecord, MaskingError> {
    let video_path = video;
    let video = &Video::open(video_path)?;
    let (frame, source) = read_frame(video, request.frame)?;
    if let Some(recipe) = &request.recipe
        && !request.force
        && !same_image(&recipe.record.source, &source)
    {
        return Err(MaskingError::OtherFrame {
            frame: request.frame,
            video: video_path.to_owned(),
            recipe: recipe.path.clone(),
        });
    }
    let turn = read_turn(video, frame.dimensions(), &request.turn)?;
    let hints = request.hints.as_ref();
    let mask = match (&turn, hints) {
        (Some(turn), hints) => segment_turn(&frame, &turn.pictures, hints, &request.settings)?,
        (None, Some(hints)) => segment(&frame, hints, &request.settings)?,
        (None, None) => return Err(MaskError::NoHints.into()),
    };
    let png = grey_png(mask.image(), "the mask")?;
    let turn_frames = turn.as_ref().map_or(&[][..], |turn| &turn.frames);
    let record = record_of(source, request, turn_frames, &mask, &png)?;
    drop(turn);
    let preview_png = rgb_png(&preview(&frame, mask.image()), "the preview")?;
    let json = record.to_json();
    let json = json.map_err(|error| MaskingError::io(&files.record, "written")(error.into()))?;
    write(&files.preview, &preview_png)?;
    if request.settings.alpha {
        let soft = alpha(&frame, mask.image());
        write(&files.alpha, &grey_png(&soft, "the soft mask")?)?;
    }
    write(&files.record, &json)?;
    write(&files.mask, &png)?;
    Ok(record)
}

fn read_frame(video: &Video, number: u64) -> Result<(RgbImage, SourceFrame), MaskingError> {
    let frame = video.frame(number)?;
    let info = video.frames().iter().find(|info| info.number == number);
    let name = video.path().file_name().unwrap_or_default();
    let source = SourceFrame {
        video: name.to_string_lossy().into_owned(),
        frame: number,
        t_us: info.map_or(0, |info| info.t_us),
        width: frame.width(),
        height: frame.height(),
        frame_blake3: blake3::hash(frame.as_raw()).to_hex().to_string(),
    };
    Ok((frame, source))
}

fn same_image(a: &SourceFrame, b: &SourceFrame) -> bool {
    (a.width, a.height, &a.frame_blake3) == (b.width, b.height, &b.frame_blake3)
}

fn record_of(
    source: SourceFrame,
    request: &MaskRequest,
    turn_frames: &[u64],
    mask: &Mask,
    png: &[u8],
) -> Result<MaskRecord, MaskingError> {
    let result = RecordedResult::new(mask.statistics(), png);
    let mut warnings: Vec<String> = mask.warnings().iter().map(Warning::to_string).collect();
    let software = MaskSoftware::current();
    if let Some(Recipe { path, record }) = &request.recipe
        && record.result.mask_blake3 != result.mask_blake3
    {
        if !request.force {
            return Err(MaskingError::NotReproduced {
                recipe: path.clone(),
                made_by: record.software.to_string(),
                now: software.to_string(),
            });
        }
        warnings.push(Warning::NotReproduced.to_string());
    }
    Ok(MaskRecord {
        schema: MASK_SCHEMA.to_owned(),
        software,
        source,
        hints: RecordedHints::new(request.hints.as_ref(), turn_frames)?,
        settings: request.settings,
        result,
        warnings,
    })
}

/// Checks that existing files may be replaced.
fn check_replaceable(files: &MaskFiles, force: bool) -> Result<(), MaskingError> {
    let record = match read_if_exists(&files.record)? {
        None => None,
        Some(bytes) => {
            let record =
                MaskRecord::from_json(&bytes).map_err(|fault| MaskingError::ForeignFile {
                    path: files.record.clone(),
                    why: fault.to_string(),
                })?;
            Some(record)
        }
    };
    if force {
        return Ok(());
    }
    let Some(mask) = read_if_exists(&files.mask)? else {
        return Ok(());
    };
    let found = blake3::hash(&mask).to_hex();
    match record {
        Some(record) if record.result.mask_blake3 == found.as_str() => Ok(()),
        _ => Err(MaskingError::Handmade(files.mask.clone())),
    }
}

fn read_if_exists(path: &Path) -> Result<Option<Vec<u8>>, MaskingError> {
    match fs::read(path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(MaskingError::io(path, "read")(error)),
    }
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), MaskingError> {
    durable::write_whole(path, bytes).map_err(MaskingError::io(path, "written"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn record_and_preview_are_named_after_the_mask() {
        let files = MaskFiles::of(Path::new("a/mug.v2.PNG")).unwrap();
        assert_eq!(files.record, Path::new("a/mug.v2.json"));
        assert_eq!(files.preview, Path::new("a/mug.v2-preview.png"));
        assert_eq!(files.alpha, Path::new("a/mug.v2-alpha.png"));
        let files = MaskFiles::of(Path::new("a/mask.png")).unwrap();
        assert_eq!(files.alpha, Path::new("a/alpha.png"));
    }

    #[test]
    fn the_name_of_a_mask_must_end_in_png() {
        for name in ["mask", "mask.jpg", "session.json", ".png", ""] {
            let files = MaskFiles::of(Path::new(name));
            assert!(matches!(files, Err(MaskingError::OutputName(_))), "{name}");
        }
    }

    #[test]
    fn a_file_that_is_not_a_record_is_never_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let files = MaskFiles::of(&folder.path().join("session.png")).unwrap();
        fs::write(&files.record, r#"{"schema": "relit.session/1"}"#).unwrap();
        let result = check_replaceable(&files, true);
        assert!(matches!(result, Err(MaskingError::ForeignFile { .. })));
    }

    #[test]
    fn a_mask_without_record_is_replaced_only_with_force() {
        let folder = tempfile::tempdir().unwrap();
        let files = MaskFiles::of(&folder.path().join("mask.png")).unwrap();
        assert!(check_replaceable(&files, false).is_ok());
        fs::write(&files.mask, "painted").unwrap();
        assert!(matches!(
            check_replaceable(&files, false),
            Err(MaskingError::Handmade(_))
        ));
        assert!(check_replaceable(&files, true).is_ok());
    }
}
