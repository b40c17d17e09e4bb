//! From a recording and a request to the files of a mask.

use std::borrow::Cow;
use std::path::Path;

use image::RgbImage;
use relit_data::durable::CreatedFolder;
use relit_data::session::{MASK_FILE, Notice, Recording};
use relit_grabcut::{Effort, Mask, grey_png, preview, rgb_png, segment_on_plain, segment_with};
use relit_video::Video;

use super::earlier::{check_same_input, keep_recipe, with_strokes};
use super::engine::cut_by_opencv;
use super::files::{check_replaceable, make_folder, write_all};
use super::request::{Recipe, TurnRequest};
use super::sampling::{SampledTurn, read_frame, read_turn, same_image};
use super::{
    MASK_SCHEMA, MaskEngine, MaskFiles, MaskRecord, MaskRequest, MaskSoftware, MaskingError,
    RecordedHints, RecordedResult, SourceFrame,
};

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

/// Makes the mask of the recording at `input`, a session folder or a video file, and writes its
/// files: to `output`, or else as `mask.png` into the session folder or, for a bare video, into the
/// working directory. Each file appears whole or not at all, the mask last; nothing is written if
/// anything before fails.
///
/// # Errors
/// [`MaskingError::Session`] without a recording; otherwise what went wrong with it, which does not name it.
pub fn make_mask(
    input: &Path,
    output: Option<MaskFiles>,
    request: &MaskRequest,
) -> Result<MaskOutput, MaskingError> {
    let prepared = Prepared::new(input, output, request)?;
    let record = segment_and_write(&prepared.video, &prepared.files, &prepared.request)?;
    Ok(MaskOutput {
        recording: prepared.recording.id,
        files: prepared.files,
        record,
        notices: prepared.notices,
    })
}

/// A recording whose mask can be made: nothing in the place of its files forbids it.
pub(super) struct Prepared<'a> {
    pub(super) recording: Recording,
    pub(super) video: Video,
    pub(super) files: MaskFiles,
    /// With the strokes of the mask that is replaced.
    pub(super) request: Cow<'a, MaskRequest>,
    pub(super) notices: Vec<Notice>,
    /// Takes away the folder of the files, if it was made for them and stays empty.
    _made: CreatedFolder,
}

impl<'a> Prepared<'a> {
    /// Opens the recording, and finds the place of its mask.
    ///
    /// # Errors
    /// As [`make_mask`].
    pub(super) fn new(
        input: &Path,
        output: Option<MaskFiles>,
        request: &'a MaskRequest,
    ) -> Result<Self, MaskingError> {
        let mut recording = Recording::open(input)?;
        let files = files_of(&recording, output)?;
        let made = make_folder(&files)?;
        check_replaceable(&files, request.all_inputs(&recording.video), request.force)?;
        let video = Video::open(&recording.video)?;
        if !request.force {
            check_same_input(&files, &recording, &video)?;
        }
        let (request, notice) = with_strokes(request, &files, &video)?;
        let notices = std::mem::take(&mut recording.notices);
        Ok(Self {
            recording,
            video,
            files,
            request,
            notices: notices.into_iter().chain(notice).collect(),
            _made: made,
        })
    }
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
        return Err(MaskingError::Refused(format!(
            "frame {} of {} is not the frame on which {} was recorded: give other hints, or --force to use the recorded ones",
            request.frame,
            video.path().display(),
            recipe.path.display()
        )));
    }
    let turn = read_turn(video, frame.dimensions(), &request.turn)?;
    let (mask, request) = cut(&frame, turn.as_ref(), request, Effort::Fine)?;
    write_files(&frame, source, turn.as_ref(), &mask, files, &request)
}

/// Cuts the object out of `frame` as the request wants it, and says by which request the same mask is made again: of a
/// photograph whose plain background was all there was to go by, with what that showed, and of a network's mask with the
/// network's marks.
pub(super) fn cut<'a>(
    frame: &RgbImage,
    turn: Option<&SampledTurn>,
    request: &'a MaskRequest,
    effort: Effort,
) -> Result<(Mask, Cow<'a, MaskRequest>), MaskingError> {
    if let Some(network) = &request.network {
        let request = MaskRequest {
            hints: network.marks(frame, &request.hints)?,
            network: None,
            found_by: Some(network.recorded()),
            ..request.clone()
        };
        let (mask, request) = cut(frame, turn, &request, effort)?;
        return Ok((mask, Cow::Owned(request.into_owned())));
    }
    let (hints, settings) = (&request.hints, &request.settings);
    if turn.is_none() && request.is_unhinted() {
        let cut = segment_on_plain(frame, &hints.strokes, settings, effort)?;
        let request = MaskRequest {
            hints: cut.hints,
            turn: TurnRequest::None,
            ..request.clone()
        };
        return Ok((cut.mask, Cow::Owned(request)));
    }
    let mask = match request.engine {
        MaskEngine::Relit => {
            let statistics = turn.map(|turn| &turn.statistics);
            segment_with(frame, statistics, hints, settings, effort)?
        }
        MaskEngine::OpenCv => cut_by_opencv(frame, hints, settings)?,
    };
    Ok((mask, Cow::Borrowed(request)))
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
    let png = grey_png(&mask.image, "the mask")?;
    let turn_frames = turn.map_or(&[][..], |turn| &turn.frames);
    let record = record_of(source, request, turn_frames, mask, &png)?;
    let preview_png = rgb_png(&preview(frame, &mask.image), "the preview")?;
    let json = record.to_json();
    let json = json.map_err(|error| MaskingError::io(&files.record, "written")(error.into()))?;
    keep_recipe(files, &record)?;
    write_all(&[
        (&files.record, &json),
        (&files.preview, &preview_png),
        (&files.mask, &png),
    ])?;
    Ok(record)
}

/// The files of a recording's mask: those that are requested, or `mask.png` in the session folder or, for
/// a bare video, in the working directory.
fn files_of(recording: &Recording, output: Option<MaskFiles>) -> Result<MaskFiles, MaskingError> {
    match output {
        Some(files) => Ok(files),
        None => {
            MaskFiles::from_mask_path(&recording.folder.clone().unwrap_or_default().join(MASK_FILE))
        }
    }
}

fn record_of(
    source: SourceFrame,
    request: &MaskRequest,
    turn_frames: &[u64],
    mask: &Mask,
    png: &[u8],
) -> Result<MaskRecord, MaskingError> {
    let result = RecordedResult::new(mask.statistics, png);
    let mut warnings = mask.warnings.clone();
    let conversion = source.colour_conversion.as_ref();
    warnings.extend(conversion.map(|by| format!("the colours were converted: {by}")));
    let software = MaskSoftware::for_engine(request.engine);
    if let Some(Recipe { path, record }) = &request.recipe
        && record.result.mask_blake3 != result.mask_blake3
    {
        if !request.force {
            return Err(MaskingError::Refused(format!(
                "the mask made with {} differs from the recorded one ({}, now {software}): nothing was written; give --force to accept the new mask",
                path.display(),
                record.software
            )));
        }
        warnings.push("this mask differs from the one that the recipe recorded".to_owned());
    }
    Ok(MaskRecord {
        schema: MASK_SCHEMA.to_owned(),
        software,
        source,
        hints: RecordedHints::new(&request.hints, turn_frames)?,
        network: request.found_by.clone(),
        engine: request.engine,
        settings: request.settings,
        result,
        warnings,
    })
}
