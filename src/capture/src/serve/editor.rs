//! The editor of masks in place: its program listens on this machine alone, and what a browser asks of it goes through
//! this server, which has let the browser in by then. So whoever reaches the rig's page reaches the editor, by the
//! same name, port and token.

use std::sync::Arc;
use std::time::Duration;

use axum::Json;
use axum::body::{Body, to_bytes};
use axum::extract::{Path, Request, State};
use axum::http::{HeaderValue, Method, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use relit_web::{Failure, SKETCH_LIMIT, forward};
use serde::Serialize;
use tokio::time::timeout;

use super::library::Library;
use super::permits::{Permits, Work};
use super::processing::{ProcessingHandle, present};
use crate::processing::EditorTarget;

/// Where the editor is served.
pub(super) const PLACE: &str = "/edit/";
/// Time in which the editor has to answer: it may look at the whole turn.
const ANSWER: Duration = Duration::from_secs(300);

/// Where the editor is.
#[derive(Debug, Serialize)]
pub(super) struct EditorPath {
    /// Its path on this server, for a browser.
    path: String,
}

/// Open a session's mask in the editor
///
/// The page at the path that is returned is served until the mask is accepted or discarded there, or nobody has
/// used it for 15 minutes. One mask is open at a time. While the rig captures, the editor is held.
pub(super) async fn open(
    State(library): State<Arc<Library>>,
    State(processing): State<ProcessingHandle>,
    State(permits): State<Arc<Permits>>,
    Path(id): Path<String>,
) -> Result<Json<EditorPath>, Failure> {
    let processing = present(processing)?;
    let opened = permits.run(Work::Command, move || {
        library.ended(&id)?;
        Ok(processing.edit(&id)?)
    });
    opened.await?;
    let path = PLACE.to_owned();
    Ok(Json(EditorPath { path }))
}

/// Close the editor
///
/// Without a mask: what was drawn is lost.
pub(super) async fn close(
    State(processing): State<ProcessingHandle>,
    State(permits): State<Arc<Permits>>,
) -> Result<StatusCode, Failure> {
    let processing = present(processing)?;
    let closed = permits.run(Work::Command, move || {
        processing.close_editor();
        Ok(())
    });
    closed.await.map(|()| StatusCode::NO_CONTENT)
}

/// Hands a request to the editor, and its answer back.
pub(super) async fn pass_on(
    State(processing): State<ProcessingHandle>,
    State(permits): State<Arc<Permits>>,
    request: Request,
) -> Result<Response, Failure> {
    let processing = present(processing)?;
    let target = permits.run(Work::Command, move || Ok(processing.editor()?));
    let target = target.await?;
    let inner = inner_request(request, &target).await?;
    let answered = timeout(ANSWER, forward(target.address, inner)).await;
    let gone = || {
        let error = "the editor does not answer: open the mask again from the list of sessions";
        Failure::new(StatusCode::BAD_GATEWAY, error)
    };
    let answer = answered.map_err(|_| gone())?.map_err(|_| gone())?;
    // Cookies and the like stay between this server and the editor.
    let (parts, body) = answer.into_parts();
    let mut response = Response::new(body);
    *response.status_mut() = parts.status;
    for name in [header::CONTENT_TYPE, header::CACHE_CONTROL] {
        if let Some(value) = parts.headers.get(&name) {
            response.headers_mut().insert(name, value.clone());
        }
    }
    Ok(response)
}

/// What the editor is asked: the path without its place here, the body, and its own token.
async fn inner_request(
    request: Request,
    target: &EditorTarget,
) -> Result<axum::http::Request<Body>, Failure> {
    let (parts, body) = request.into_parts();
    let path = parts.uri.path_and_query().map_or("/", |path| path.as_str());
    let path = format!("/{}", path.strip_prefix(PLACE).unwrap_or_default());
    let uri: Uri = path
        .parse()
        .map_err(|_| Failure::bad_request("the editor has no such path"))?;
    let body = timeout(SKETCH_LIMIT.time, to_bytes(body, SKETCH_LIMIT.bytes)).await;
    let body = body.map_err(|_| {
        let error = "the drawing did not come in time";
        Failure::new(StatusCode::REQUEST_TIMEOUT, error)
    })?;
    let too_large = |_| Failure::new(StatusCode::PAYLOAD_TOO_LARGE, "the drawing is too large");
    let body = body.map_err(too_large)?;
    let mut inner = axum::http::Request::new(Body::from(body));
    *inner.method_mut() = match parts.method {
        Method::POST => Method::POST,
        _ => Method::GET,
    };
    *inner.uri_mut() = uri;
    let headers = inner.headers_mut();
    if let Some(kind) = parts.headers.get(header::CONTENT_TYPE) {
        headers.insert(header::CONTENT_TYPE, kind.clone());
    }
    let value = |text: String| {
        HeaderValue::from_str(&text)
            .map_err(|_| Failure::internal("the editor's address cannot be written"))
    };
    headers.insert(header::HOST, value(target.address.to_string())?);
    let token = value(format!("Bearer {}", target.token))?;
    headers.insert(header::AUTHORIZATION, token);
    Ok(inner)
}

/// The editor's own place ends in a slash, so that what its page loads is looked for below it.
pub(super) async fn with_slash() -> Response {
    axum::response::Redirect::permanent(PLACE).into_response()
}
