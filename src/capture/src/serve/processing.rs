//! What is made of sessions: the jobs, their settings, and the pages that come out.

use std::sync::Arc;

use axum::Json;
use axum::extract::{Path, State};
use axum::http::{HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};

use super::library::Library;
use super::permits::{Permits, Work};
use crate::command::CommandError;
use crate::processing::{Processing, ProcessingSettings};
use crate::state::{Monitor, ProcessingState, ProcessingStep};
use relit_web::{Failure, JsonBody};

/// The pages hold their own style and pictures, no scripts, and load nothing.
const PAGE_POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'none'; sandbox";

/// What works on sessions, where something does.
pub(super) type ProcessingHandle = Option<Arc<Processing>>;

/// What works on sessions, or that nothing does.
pub(super) fn present(processing: ProcessingHandle) -> Result<Arc<Processing>, Failure> {
    processing.ok_or_else(|| {
        CommandError::Unavailable("this server does not process sessions".to_owned()).into()
    })
}

/// Steps for a session, in their order.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RequestedSteps {
    /// `mask`, `check`, `extract`, or several of them.
    steps: Vec<ProcessingStep>,
}

/// A job that was queued.
#[derive(Debug, Serialize)]
pub(super) struct QueuedJob {
    /// Its number.
    number: u64,
}

/// Process a session
///
/// Queues steps, which are done one after the other at the lowest priority, and only while the rig rests. What
/// comes of them shows in the state (`processing`) and in the session's `results`. A check that does not fit
/// ends the steps of its session.
pub(super) async fn process(
    State(library): State<Arc<Library>>,
    State(processing): State<ProcessingHandle>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
    JsonBody(RequestedSteps { steps }): JsonBody<RequestedSteps>,
) -> Result<Response, Failure> {
    let processing = present(processing)?;
    let queued = permits.run(Work::Command, move || {
        library.ended(&id)?;
        Ok(processing.submit(&id, &steps)?)
    });
    let number = queued.await?;
    Ok((StatusCode::ACCEPTED, Json(QueuedJob { number })).into_response())
}

/// Cancel a job
///
/// Its program is ended; what follows in its session is not begun.
pub(super) async fn cancel(
    State(processing): State<ProcessingHandle>,
    State(permits): State<Arc<Permits>>,
    Path(number): Path<String>,
) -> Result<StatusCode, Failure> {
    let none = || Failure::not_found("no job of that number waits or is under way");
    let number: u64 = number.parse().map_err(|_| none())?;
    let processing = present(processing)?;
    let cancelled = permits.run(Work::Command, move || Ok(processing.cancel(number)));
    if cancelled.await? {
        Ok(StatusCode::NO_CONTENT)
    } else {
        Err(none())
    }
}

/// Jobs, programs and settings
pub(super) async fn state(State(monitor): State<Monitor>) -> Json<ProcessingState> {
    Json(monitor.state().processing)
}

/// Change how sessions are processed
///
/// The settings are kept on the disk.
pub(super) async fn configure(
    State(processing): State<ProcessingHandle>,
    State(monitor): State<Monitor>,
    State(permits): State<Arc<Permits>>,
    JsonBody(settings): JsonBody<ProcessingSettings>,
) -> Result<Json<ProcessingState>, Failure> {
    let processing = present(processing)?;
    let changed = permits.run(Work::Command, move || {
        processing.configure(settings);
        Ok(())
    });
    changed.await?;
    Ok(state(State(monitor)).await)
}

/// The page about the check of a session's mask
pub(super) async fn check_page(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
) -> Result<Response, Failure> {
    let page = permits.run(Work::Listing, move || library.check_page(&id));
    Ok(html(page.await?))
}

/// The page about a session in the data set
pub(super) async fn report_page(
    State(library): State<Arc<Library>>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
) -> Result<Response, Failure> {
    let page = permits.run(Work::Listing, move || library.report_page(&id));
    Ok(html(page.await?))
}

fn html(page: Vec<u8>) -> Response {
    let headers: [(HeaderName, HeaderValue); 2] = [
        (
            header::CONTENT_TYPE,
            HeaderValue::from_static("text/html; charset=utf-8"),
        ),
        (
            header::CONTENT_SECURITY_POLICY,
            HeaderValue::from_static(PAGE_POLICY),
        ),
    ];
    (headers, page).into_response()
}
