//! The editor of masks in place: whoever reaches the rig's page reaches the editor, by the same name, port and token.

use std::sync::Arc;

use axum::Json;
use axum::extract::{Path, Request, State};
use axum::http::StatusCode;
use axum::response::{Html, IntoResponse, Response};
use relit_mask::MaskEditor;
use relit_web::Failure;
use serde::Serialize;
use tower_service::Service;

use super::library::Library;
use super::permits::{Permits, Work};
use super::processing::{ProcessingHandle, present};

/// Where the editor is served.
pub(super) const PLACE: &str = "/edit/";

/// Where the editor is.
#[derive(Debug, Serialize)]
pub(super) struct EditorPath {
    /// Its path on this server, for a browser.
    path: String,
}

/// Open a session's mask in the editor
///
/// The page at the path that is returned is served until the mask is accepted or discarded there, or nobody has
/// used it for 15 minutes. One mask is open at a time. While the rig captures, the editor answers 503.
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
    closed.await?;
    Ok(StatusCode::NO_CONTENT)
}

/// The editor's page
pub(super) async fn page(
    State(processing): State<ProcessingHandle>,
) -> Result<impl IntoResponse, Failure> {
    let _open = present(processing)?.editor()?;
    Ok(Html(MaskEditor::PAGE.0))
}

/// Hands a request to the editor.
pub(super) async fn pass_on(
    State(processing): State<ProcessingHandle>,
    mut request: Request,
) -> Result<Response, Failure> {
    let mut editor = present(processing)?.editor()?;
    let path = request.uri().path_and_query();
    let path = path.map_or("/", |path| path.as_str());
    let path = format!("/{}", path.strip_prefix(PLACE).unwrap_or_default());
    *request.uri_mut() = path
        .parse()
        .map_err(|_| Failure::bad_request("the editor has no such path"))?;
    // The rest of the path that led here is no parameter of the editor's.
    request.extensions_mut().clear();
    match editor.call(request).await {
        Ok(answer) => Ok(answer),
        Err(never) => match never {},
    }
}

/// The editor's own place ends in a slash, so that what its page loads is looked for below it.
pub(super) async fn with_slash() -> Response {
    axum::response::Redirect::permanent(PLACE).into_response()
}
