//! Which path leads where, and what the handlers share.

use std::sync::Arc;

use axum::Router;
use axum::extract::{FromRef, Request};
use axum::http::StatusCode;
use axum::middleware::from_fn_with_state;
use axum::routing::{MethodRouter, get, post};

use super::access::{AccessPolicy, guard};
use super::failure::Failure;
use super::library::Library;
use super::metrics::Responses;
use super::permits::Permits;
use super::pictures::Pictures;
use super::rig::Rig;
use super::snapshots::Snapshots;
use super::{ClientLimits, Shutdown, api, files, metrics, openapi, page, preview, sessions};
use crate::state::Monitor;

/// What all requests share; each handler takes the parts that it needs.
#[derive(Clone, FromRef)]
pub(super) struct App {
    pub(super) rig: Arc<dyn Rig>,
    pub(super) monitor: Monitor,
    pub(super) snapshots: Snapshots,
    pub(super) policy: Arc<AccessPolicy>,
    pub(super) limits: ClientLimits,
    pub(super) permits: Arc<Permits>,
    pub(super) library: Arc<Library>,
    pub(super) pictures: Arc<Pictures>,
    pub(super) responses: Arc<Responses>,
    pub(super) shutdown: Shutdown,
}

impl App {
    pub(super) fn new(
        rig: Arc<dyn Rig>,
        policy: AccessPolicy,
        limits: ClientLimits,
        shutdown: Shutdown,
    ) -> Self {
        Self {
            monitor: rig.monitor().clone(),
            snapshots: Snapshots::new(rig.monitor()),
            policy: Arc::new(policy),
            limits,
            permits: Arc::new(Permits::new(&limits)),
            library: Arc::new(Library::new(rig.root().to_owned())),
            pictures: Arc::new(Pictures::new()),
            responses: Arc::default(),
            shutdown,
            rig,
        }
    }
}

/// The interface for programs.
pub(super) fn interface() -> [(&'static str, MethodRouter<App>); 13] {
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
pub(super) fn router(app: &App) -> Router {
    let mut router = Router::new().route("/", get(page::index));
    for asset in &page::ASSETS {
        router = router.route(asset.path, get(async || asset.answer()));
    }
    for (path, methods) in interface() {
        router = router.route(path, methods);
    }
    router
        .fallback(no_such_path)
        .method_not_allowed_fallback(no_such_method)
        .layer(from_fn_with_state(app.clone(), guard))
        .layer(from_fn_with_state(app.clone(), metrics::count))
        .with_state(app.clone())
}

async fn no_such_path(request: Request) -> Failure {
    let path = request.uri().path();
    Failure::not_found(format!(
        "there is nothing at {path}: /api/v1/openapi.json describes what there is"
    ))
}

async fn no_such_method(request: Request) -> Failure {
    let (method, path) = (request.method(), request.uri().path());
    let error = format!(
        "{path} cannot be asked with {method}: /api/v1/openapi.json describes with what it can"
    );
    Failure::new(StatusCode::METHOD_NOT_ALLOWED, error)
}
