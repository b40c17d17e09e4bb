//! Which path leads where.

use std::sync::Arc;

use axum::Router;
use axum::extract::Request;
use axum::http::StatusCode;
use axum::middleware::from_fn_with_state;
use axum::routing::{MethodRouter, get, post};

use super::answer::Failure;
use super::server::Server;
use super::{api, files, gate, metrics, openapi, page, preview, sessions};

/// The interface for programs.
pub(super) fn interface() -> [(&'static str, MethodRouter<Arc<Server>>); 13] {
    [
        ("/api/v1/state", get(api::state)),
        ("/api/v1/events", get(api::events)),
        ("/api/v1/command", post(api::command)),
        ("/api/v1/preview.jpg", get(preview::picture)),
        ("/api/v1/preview.mjpg", get(preview::stream)),
        ("/api/v1/sessions", get(sessions::list)),
        ("/api/v1/sessions/{id}", get(sessions::detail)),
        (
            "/api/v1/sessions/{id}/thumbnail.jpg",
            get(sessions::thumbnail),
        ),
        ("/api/v1/sessions/{id}/frames/{frame}", get(sessions::frame)),
        ("/api/v1/sessions/{id}/video", get(files::video)),
        ("/api/v1/objects", get(sessions::objects)),
        ("/api/v1/openapi.json", get(openapi::document)),
        ("/metrics", get(metrics::metrics)),
    ]
}

/// Everything that is served.
pub(super) fn router(server: &Arc<Server>) -> Router {
    let mut router = Router::new().route("/", get(page::index));
    for asset in &page::ASSETS {
        router = router.route(asset.path, get(async || asset.answer()));
    }
    for (path, methods) in interface() {
        router = router.route(path, methods);
    }
    router
        .fallback(nothing_here)
        .method_not_allowed_fallback(not_so)
        .layer(from_fn_with_state(server.clone(), gate::pass))
        .with_state(server.clone())
}

async fn nothing_here(request: Request) -> Failure {
    let path = request.uri().path();
    Failure::not_found(format!(
        "there is nothing at {path}: /api/v1/openapi.json tells what there is"
    ))
}

async fn not_so(request: Request) -> Failure {
    let (method, path) = (request.method(), request.uri().path());
    let error = format!(
        "{path} cannot be asked with {method}: /api/v1/openapi.json tells with what it can"
    );
    Failure::new(StatusCode::METHOD_NOT_ALLOWED, error)
}
