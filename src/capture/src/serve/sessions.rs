//! What was recorded: the list of sessions, one of them, and pictures out of it.

use std::sync::Arc;

use axum::Json;
use axum::extract::{Path, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;

use super::files::session_tar;
use super::library::{Library, SessionSummary};
use super::permits::{Permits, Work};
use super::pictures::Pictures;
use super::processing::ProcessingHandle;
use relit_web::{Failure, JsonBody, QueryParams};

/// Sessions in one answer, unless asked otherwise, and at most.
const SESSIONS: usize = 100;
const MAX_SESSIONS: usize = 1000;
/// Width of a frame in the player, unless asked otherwise, and what can be requested; pixels.
const WIDTH: u32 = 960;
const WIDTHS: std::ops::RangeInclusive<u32> = 64..=1920;
/// Recorded pictures do not change.
const KEEP: &str = "private, max-age=86400";

/// Which part of the list.
#[derive(Debug, Deserialize)]
pub(super) struct Part {
    /// Only sessions whose name comes before this one: the last of the part before.
    before: Option<String>,
    /// How many, up to 1000; 100 if left out.
    limit: Option<usize>,
    /// Only those of a day (UTC), as session names begin.
    day: Option<String>,
}

/// The sessions, newest first
pub(super) async fn list(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
    QueryParams(Part { before, limit, day }): QueryParams<Part>,
) -> Result<Json<Vec<SessionSummary>>, Failure> {
    let most = limit.unwrap_or(SESSIONS).min(MAX_SESSIONS);
    let list = permits.run(Work::Listing, move || {
        library.list(before.as_deref(), day.as_deref(), most)
    });
    Ok(Json(list.await?))
}

/// One session, with each frame's time and angle
pub(super) async fn detail(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
) -> Result<Response, Failure> {
    // One path for the router: a session's name may end in anything, also in `.tar`.
    if let Some(session) = id.strip_suffix(".tar")
        && library.has(session)
    {
        return session_tar(library, permits, session.to_owned()).await;
    }
    let detail = permits.run(Work::Listing, move || library.detail(&id));
    Ok(Json(detail.await?).into_response())
}

/// Put a session away
///
/// Into the folder `.trash` beside the sessions, which nobody empties but a person. Work on it is cancelled.
pub(super) async fn move_to_trash(
    State(library): State<Arc<Library>>,
    State(processing): State<ProcessingHandle>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
) -> Result<StatusCode, Failure> {
    let done = permits.run(Work::Command, move || {
        library.ended(&id)?;
        if let Some(processing) = processing {
            processing.release(&id);
        }
        library.move_to_trash(&id)
    });
    done.await.map(|()| StatusCode::NO_CONTENT)
}

/// Take a session back out of `.trash`
pub(super) async fn restore(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
) -> Result<StatusCode, Failure> {
    let done = permits.run(Work::Listing, move || library.restore(&id));
    done.await.map(|()| StatusCode::NO_CONTENT)
}

/// The sessions in `.trash`, newest first
pub(super) async fn trash(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
) -> Result<Json<Vec<SessionSummary>>, Failure> {
    let list = permits.run(Work::Listing, move || library.trash());
    Ok(Json(list.await?))
}

/// What a person says about a take; a field that is left out or `null` is removed.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Annotations {
    /// A note of up to 2000 characters.
    note: Option<String>,
    /// 1 to 5.
    rating: Option<u8>,
}

/// Note and rating of a session
///
/// Written to its manifest.
pub(super) async fn annotate(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
    JsonBody(Annotations { note, rating }): JsonBody<Annotations>,
) -> Result<StatusCode, Failure> {
    let done = permits.run(Work::Listing, move || {
        library.annotate(&id, note.as_deref(), rating)
    });
    done.await.map(|()| StatusCode::NO_CONTENT)
}

/// The first frame, small
pub(super) async fn thumbnail(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
) -> Result<Response, Failure> {
    let jpeg = permits.run(Work::Decoding, move || {
        Pictures::thumbnail(&library.video_file(&id)?)
    });
    Ok(picture(jpeg.await?))
}

/// How large.
#[derive(Debug, Deserialize)]
pub(super) struct Size {
    /// Greatest width, 64 to 1920 pixels; 960 if left out.
    width: Option<u32>,
}

/// One frame
pub(super) async fn frame(
    State(library): State<Arc<Library>>,
    State(pictures): State<Arc<Pictures>>,
    State(permits): State<Arc<Permits>>,
    Path((id, frame)): Path<(String, String)>,
    QueryParams(Size { width }): QueryParams<Size>,
) -> Result<Response, Failure> {
    let number = frame.strip_suffix(".jpg").and_then(|n| n.parse().ok());
    let unknown = || Failure::not_found("no such frame: ask for a number and \".jpg\"");
    let number: u64 = number.ok_or_else(unknown)?;
    let width = width.unwrap_or(WIDTH).clamp(*WIDTHS.start(), *WIDTHS.end());
    let jpeg = permits.run(Work::Decoding, move || {
        pictures.frame(library.video_file(&id)?, number, width)
    });
    Ok(picture(jpeg.await?))
}

fn picture(jpeg: axum::body::Bytes) -> Response {
    let headers = [
        (header::CONTENT_TYPE, "image/jpeg"),
        (header::CACHE_CONTROL, KEEP),
    ];
    (headers, jpeg).into_response()
}
