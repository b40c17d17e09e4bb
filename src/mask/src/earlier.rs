//! What a person painted for an earlier mask: it is applied again to the one that replaces it, and its recipe is
//! kept.

use std::borrow::Cow;

use relit_data::counts::count_of;
use relit_data::session::{Notice, Recording};
use relit_video::Video;

use super::files::{read_if_exists, read_record, write};
use super::request::TurnRequest;
use super::sampling::{read_frame, same_image};
use super::{MaskFiles, MaskRecord, MaskRequest, MaskingError};

/// A request with the strokes of the mask that it replaces, and what its user should know of them. They are taken
/// over unless the request has its own, is a recipe, or is forced.
///
/// # Errors
/// [`MaskingError::Refused`] if they were painted on another recording; [`MaskingError::Unusable`] if they cannot
/// be read.
pub(super) fn with_strokes<'a>(
    request: &'a MaskRequest,
    files: &MaskFiles,
    video: &Video,
) -> Result<(Cow<'a, MaskRequest>, Option<Notice>), MaskingError> {
    let Some(record) = read_record(&files.record)?.filter(has_strokes) else {
        return Ok((Cow::Borrowed(request), None));
    };
    let strokes = count_of(record.hints.strokes.count() as u64, "stroke");
    let has_own = request.recipe.is_some() || !request.hints.strokes.is_empty();
    if has_own || request.force {
        let is_lost = record.hints.strokes != request.hints.strokes;
        let notice = Notice::Warning(format!(
            "left out {strokes} of the earlier mask: its recipe is kept as {}",
            files.previous.display()
        ));
        return Ok((Cow::Borrowed(request), is_lost.then_some(notice)));
    }
    if !is_of(&record, video) {
        return Err(MaskingError::Refused(format!(
            "{} holds strokes that were painted on another recording: give another name with -o, or --force to make the mask without them",
            files.record.display()
        )));
    }
    let notice = Notice::Warning(format!(
        "applied {strokes} of the earlier mask again: --force leaves them out"
    ));
    let mut request = request.clone();
    if request.hints.is_empty() && request.turn == TurnRequest::None && request.network.is_none() {
        // Nothing but the editor was asked for: it goes on where it stopped.
        request.turn = TurnRequest::from_record(&record);
        request.frame = record.source.frame;
        let unusable = |fault| MaskingError::unusable("recipe", &files.record, &fault);
        request.hints = record.hints.hints().map_err(unusable)?;
        request.found_by = record.network;
    } else {
        request.hints.strokes = record.hints.strokes;
    }
    Ok((Cow::Owned(request), Some(notice)))
}

/// Checks that the mask that is there, if any, was made of this recording: a mask in a session's own folder always
/// was.
///
/// # Errors
/// [`MaskingError::OtherInput`]; [`MaskingError::ForeignFile`] or [`MaskingError::Io`] if the record cannot be read.
pub(super) fn check_same_input(
    files: &MaskFiles,
    recording: &Recording,
    video: &Video,
) -> Result<(), MaskingError> {
    let folder = recording.folder.as_deref();
    let is_own = folder.is_some() && folder == files.mask.parent();
    if is_own || !files.mask.exists() {
        return Ok(());
    }
    match read_record(&files.record)? {
        Some(record) if !is_of(&record, video) => Err(MaskingError::OtherInput {
            mask: files.mask.clone(),
            input: record.source.video,
        }),
        _ => Ok(()),
    }
}

fn has_strokes(record: &MaskRecord) -> bool {
    !record.hints.strokes.is_empty()
}

/// Whether a mask was made on this video.
fn is_of(record: &MaskRecord, video: &Video) -> bool {
    let found = read_frame(video, record.source.frame);
    found.is_ok_and(|(_, source)| same_image(&record.source, &source))
}

/// Keeps the record that `new` is about to replace, if a person painted for it and the new recipe is another.
pub(super) fn keep_recipe(files: &MaskFiles, new: &MaskRecord) -> Result<(), MaskingError> {
    let Some(old) = read_record(&files.record)? else {
        return Ok(());
    };
    let is_painted = has_strokes(&old) || old.hints.seeds.is_some();
    if !is_painted || is_same_recipe(&old, new) {
        return Ok(());
    }
    match read_if_exists(&files.record)? {
        Some(bytes) => write(&files.previous, &bytes),
        None => Ok(()),
    }
}

/// Whether two records make the same mask.
fn is_same_recipe(a: &MaskRecord, b: &MaskRecord) -> bool {
    let rest = (&a.hints, &a.engine, &a.settings) == (&b.hints, &b.engine, &b.settings);
    rest && same_image(&a.source, &b.source)
}
