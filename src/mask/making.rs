//! From a recording and a request to the files of a mask.

use std::path::Path;

use image::RgbImage;
use relit_data::session::{MASK_FILE, Notice, Recording};
use relit_grabcut::{Effort, Mask, Warning, alpha, grey_png, preview, rgb_png, segment_with};
use relit_video::Video;

use super::earlier::{keep_recipe, with_strokes};
use super::engine::cut_by_opencv;
use super::files::{check_replaceable, has_alpha, make_folder, remove, write};
use super::request::Recipe;
use super::sampling::{SampledTurn, read_frame, read_turn, same_image};
use super::{
    MASK_SCHEMA, MaskEngine, MaskFiles, MaskRecord, MaskRequest, MaskSoftware, MaskingError,
    RecordedHints, RecordedResult, SourceFrame,
};

/// A mask that was written.
#[derive(Debug, Clone)]
#[non_exhaustive]
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
        Ok((files, record, notice)) => Ok(MaskOutput {
            recording: recording.id,
            files,
            record,
            notices: recording.notices.into_iter().chain(notice).collect(),
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
) -> Result<(MaskFiles, MaskRecord, Option<Notice>), MaskingError> {
    let files = files_of(recording, output)?;
    let _made = make_folder(&files)?;
    check_replaceable(&files, request.force, request.settings.alpha)?;
    let video = Video::open(&recording.video)?;
    let (request, notice) = with_strokes(request, &files, &video)?;
    let record = segment_and_write(&video, &files, &request)?;
    Ok((files, record, notice))
}

fn segment_and_write(
    video: &Video,
    files: &MaskFiles,
    request: &MaskRequest,
) -> Result<MaskRecord, MaskingError> {
    let (frame, source) = read_frame(video, request.frame)?;
    if let Some(recipe) = &request.recipe
        && !request.force
        && !same_image(&recipe.record.source, &source)
    {
        return Err(MaskingError::OtherFrame {
            frame: request.frame,
            video: video.path().to_owned(),
            recipe: recipe.path.clone(),
        });
    }
    let turn = read_turn(video, frame.dimensions(), &request.turn)?;
    let mask = cut(&frame, turn.as_ref(), request, Effort::Fine)?;
    write_files(&frame, source, turn.as_ref(), &mask, files, request)
}

/// Cuts the object out of `frame` as the request wants it.
pub(super) fn cut(
    frame: &RgbImage,
    turn: Option<&SampledTurn>,
    request: &MaskRequest,
    effort: Effort,
) -> Result<Mask, MaskingError> {
    let hints = request.drawing.hints(frame.dimensions(), turn.is_some())?;
    let (hints, settings) = (hints.as_ref(), &request.settings);
    match request.engine {
        MaskEngine::Relit => {
            let statistics = turn.map(|turn| &turn.statistics);
            Ok(segment_with(frame, statistics, hints, settings, effort)?)
        }
        MaskEngine::OpenCv => cut_by_opencv(frame, hints, settings),
    }
}

/// Writes a mask that was made by [`cut`] on `frame`, with its record and its preview: each file appears
/// whole or not at all, the mask last. A record for which a person painted is kept.
pub(super) fn write_files(
    frame: &RgbImage,
    source: SourceFrame,
    turn: Option<&SampledTurn>,
    mask: &Mask,
    files: &MaskFiles,
    request: &MaskRequest,
) -> Result<MaskRecord, MaskingError> {
    let png = grey_png(mask.image(), "the mask")?;
    let turn_frames = turn.map_or(&[][..], |turn| &turn.frames);
    let record = record_of(source, request, turn_frames, mask, &png)?;
    let preview_png = rgb_png(&preview(frame, mask.image()), "the preview")?;
    let json = record.to_json();
    let json = json.map_err(|error| MaskingError::io(&files.record, "written")(error.into()))?;
    let soft = match request.settings.alpha {
        true => Some(grey_png(&alpha(frame, mask.image()), "the soft mask")?),
        false => None,
    };
    // A soft mask of an earlier mask would be taken for this one's.
    let is_stale = soft.is_none() && has_alpha(files)?;
    keep_recipe(files, &record)?;
    write(&files.preview, &preview_png)?;
    if let Some(soft) = soft {
        write(&files.alpha, &soft)?;
    }
    write(&files.record, &json)?;
    write(&files.mask, &png)?;
    if is_stale {
        remove(&files.alpha)?;
    }
    Ok(record)
}

/// The files of a recording's mask: those that are asked for, or `mask.png` in the session folder or, for
/// a bare video, in the working directory.
pub(super) fn files_of(
    recording: &Recording,
    output: Option<MaskFiles>,
) -> Result<MaskFiles, MaskingError> {
    match output {
        Some(files) => Ok(files),
        None => MaskFiles::of(&recording.folder.clone().unwrap_or_default().join(MASK_FILE)),
    }
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
    let conversion = source.colour_conversion.as_ref();
    warnings.extend(conversion.map(|by| format!("the colours were converted: {by}")));
    let software = MaskSoftware::of(request.engine);
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
        hints: RecordedHints::new(&request.drawing, turn_frames)?,
        engine: request.engine,
        settings: request.settings,
        result,
        warnings,
    })
}
