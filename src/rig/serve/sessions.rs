//! What was recorded: the list of sessions, one of them, and pictures out of it.

use std::sync::Arc;

use axum::Json;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use utoipa::{IntoParams, ToSchema};

use super::files::session_tar;
use super::library::{Library, SessionDetail, SessionSummary};
use super::permits::{Permits, Work};
use super::pictures::Pictures;
use super::processing::MayProcess;
use relit_web::{Failure, JsonBody, Problem, QueryParams};

/// Sessions in one answer, unless asked otherwise, and at most.
const SESSIONS: usize = 100;
const MOST_SESSIONS: usize = 1000;
/// Names that are suggested.
const OBJECTS: usize = 20;
/// Width of a frame in the player, unless asked otherwise, and what can be asked for; pixels.
const WIDTH: u32 = 960;
const WIDTHS: std::ops::RangeInclusive<u32> = 64..=1920;
/// Recorded pictures do not change.
const KEEP: &str = "private, max-age=86400";

/// Which part of the list.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub(super) struct Part {
    /// Only sessions whose name comes before this one: the last of the part before.
    before: Option<String>,
    /// How many, up to 1000; 100 if left out.
    limit: Option<usize>,
    /// Only those of a day (UTC), as session names begin.
    #[param(example = "20261120")]
    day: Option<String>,
}

/// The sessions, newest first
#[utoipa::path(
    get, path = "/api/v1/sessions", tag = "sessions", params(Part),
    responses((status = 200, body = [SessionSummary]), (status = 401, body = Problem))
)]
pub(super) async fn list(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
    QueryParams(Part { before, limit, day }): QueryParams<Part>,
) -> Result<Json<Vec<SessionSummary>>, Failure> {
    let most = limit.unwrap_or(SESSIONS).min(MOST_SESSIONS);
    let list = permits.run(Work::Listing, move || {
        library.list(before.as_deref(), day.as_deref(), most)
    });
    Ok(Json(list.await?))
}

/// One session, with each frame's time and angle
#[utoipa::path(
    get, path = "/api/v1/sessions/{id}", tag = "sessions",
    params(("id" = String, Path, description = "The session's name")),
    responses(
        (status = 200, body = SessionDetail), (status = 401, body = Problem),
        (status = 404, description = "No such session", body = Problem),
    )
)]
pub(super) async fn detail(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Failure> {
    // One path for the router: a session's name may end in anything, also in `.tar`.
    if let Some(session) = id.strip_suffix(".tar")
        && library.has(session)
    {
        return session_tar(library, permits, session.to_owned(), &headers).await;
    }
    let detail = permits.run(Work::Listing, move || library.detail(&id));
    Ok(Json(detail.await?).into_response())
}

/// Put a session away
///
/// Into the folder `.trash` beside the sessions, which nobody empties but a person. Work on it is cancelled.
#[utoipa::path(
    delete, path = "/api/v1/sessions/{id}", tag = "sessions",
    params(("id" = String, Path, description = "The session's name")),
    responses(
        (status = 204, description = "Done"),
        (status = 401, body = Problem),
        (status = 404, description = "No such session", body = Problem),
        (status = 409, description = "Still being recorded, or one of that name is there", body = Problem),
    )
)]
pub(super) async fn put_away(
    State(library): State<Arc<Library>>,
    State(processing): State<MayProcess>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
) -> Result<StatusCode, Failure> {
    let done = permits.run(Work::Command, move || {
        library.ended(&id)?;
        processing.map_or(Ok(()), |processing| processing.release(&id))?;
        library.put_away(&id)
    });
    done.await.map(|()| StatusCode::NO_CONTENT)
}

/// Take a session back out of `.trash`
#[utoipa::path(
    post, path = "/api/v1/sessions/{id}/restore", tag = "sessions",
    params(("id" = String, Path, description = "The session's name")),
    responses(
        (status = 204, description = "Done"),
        (status = 401, body = Problem),
        (status = 404, description = "No such session was put away", body = Problem),
        (status = 409, description = "One of that name is there", body = Problem),
    )
)]
pub(super) async fn restore(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
) -> Result<StatusCode, Failure> {
    let done = permits.run(Work::Listing, move || library.restore(&id));
    done.await.map(|()| StatusCode::NO_CONTENT)
}

/// The sessions in `.trash`, newest first
#[utoipa::path(
    get, path = "/api/v1/trash", tag = "sessions",
    responses((status = 200, body = [SessionSummary]), (status = 401, body = Problem))
)]
pub(super) async fn trash(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
) -> Result<Json<Vec<SessionSummary>>, Failure> {
    let list = permits.run(Work::Listing, move || library.trash());
    Ok(Json(list.await?))
}

/// What a person says of a take; a field that is left out or `null` is removed.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Remarks {
    /// A note of up to 2000 characters.
    note: Option<String>,
    /// 1 to 5.
    rating: Option<u8>,
}

/// Note and rating of a session
///
/// Written to its manifest.
#[utoipa::path(
    put, path = "/api/v1/sessions/{id}/remarks", tag = "sessions", request_body = Remarks,
    params(("id" = String, Path, description = "The session's name")),
    responses(
        (status = 204, description = "Done"),
        (status = 400, description = "Not understood", body = Problem),
        (status = 401, body = Problem),
        (status = 404, description = "No such session", body = Problem),
        (status = 409, description = "Still being recorded", body = Problem),
        (status = 415, description = "Not JSON", body = Problem),
    )
)]
pub(super) async fn remark(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
    JsonBody(Remarks { note, rating }): JsonBody<Remarks>,
) -> Result<StatusCode, Failure> {
    let done = permits.run(Work::Listing, move || {
        library.remark(&id, note.as_deref(), rating)
    });
    done.await.map(|()| StatusCode::NO_CONTENT)
}

/// The first frame, small
#[utoipa::path(
    get, path = "/api/v1/sessions/{id}/thumbnail.jpg", tag = "sessions",
    params(("id" = String, Path, description = "The session's name")),
    responses(
        (status = 200, description = "A JPEG file", content_type = "image/jpeg"),
        (status = 401, body = Problem),
        (status = 404, description = "No such session", body = Problem),
        (status = 409, description = "Still being recorded", body = Problem),
    )
)]
pub(super) async fn thumbnail(
    State(library): State<Arc<Library>>,
    State(pictures): State<Arc<Pictures>>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
) -> Result<Response, Failure> {
    let jpeg = permits.run(Work::Decoding, move || {
        pictures.thumbnail(library.video_file(&id)?)
    });
    Ok(picture(jpeg.await?))
}

/// How large.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub(super) struct Size {
    /// Greatest width, 64 to 1920 pixels; 960 if left out.
    width: Option<u32>,
}

/// One frame
#[utoipa::path(
    get, path = "/api/v1/sessions/{id}/frames/{frame}", tag = "sessions",
    params(
        ("id" = String, Path, description = "The session's name"),
        ("frame" = String, Path, description = "The frame's number, 0-based, and `.jpg`", example = "0.jpg"),
        Size,
    ),
    responses(
        (status = 200, description = "A JPEG file", content_type = "image/jpeg"),
        (status = 401, body = Problem),
        (status = 404, description = "No such session or frame", body = Problem),
        (status = 409, description = "Still being recorded", body = Problem),
    )
)]
pub(super) async fn frame(
    State(library): State<Arc<Library>>,
    State(pictures): State<Arc<Pictures>>,
    State(permits): State<Arc<Permits>>,
    Path((id, frame)): Path<(String, String)>,
    QueryParams(Size { width }): QueryParams<Size>,
) -> Result<Response, Failure> {
    let number = frame.strip_suffix(".jpg").and_then(|n| n.parse().ok());
    let unknown = || Failure::not_found("there is no such frame: ask for a number and \".jpg\"");
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

/// Names of objects captured last, newest first
#[utoipa::path(
    get, path = "/api/v1/objects", tag = "sessions",
    responses((status = 200, body = [String]), (status = 401, body = Problem))
)]
pub(super) async fn objects(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
) -> Result<Json<Vec<String>>, Failure> {
    let objects = permits.run(Work::Listing, move || library.objects(OBJECTS));
    Ok(Json(objects.await?))
}
