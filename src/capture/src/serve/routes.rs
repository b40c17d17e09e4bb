//! Which path leads where, and what the handlers share.

use std::sync::Arc;

use axum::Router;
use axum::extract::{FromRef, Request};
use axum::http::StatusCode;
use axum::middleware::from_fn_with_state;
use axum::routing::{any, delete, get, post, put};

use super::library::Library;
use super::options::ClientLimits;
use super::permits::Permits;
use super::pictures::Pictures;
use super::processing::ProcessingHandle;
use super::{api, editor, files, page, preview, processing, sessions};
use crate::command::Rig;
use crate::state::Monitor;
use relit_web::Shutdown;
use relit_web::{AccessPolicy, BodyLimit, Failure, IndexPage, guard};

/// Largest body of a request, bytes.
const MAX_BODY: usize = 16 * 1024;

/// What all requests share; each handler takes the parts that it needs.
#[derive(Clone, FromRef)]
pub(super) struct App {
    pub(super) rig: Arc<dyn Rig>,
    pub(super) monitor: Monitor,
    pub(super) policy: Arc<AccessPolicy>,
    pub(super) limits: ClientLimits,
    pub(super) permits: Arc<Permits>,
    pub(super) library: Arc<Library>,
    pub(super) pictures: Arc<Pictures>,
    pub(super) shutdown: Shutdown,
    pub(super) processing: ProcessingHandle,
}

impl App {
    pub(super) fn new(
        rig: Arc<dyn Rig>,
        policy: Arc<AccessPolicy>,
        limits: ClientLimits,
        shutdown: Shutdown,
        processing: ProcessingHandle,
    ) -> Self {
        let root = rig.root().to_owned();
        let beside = root.with_file_name("dataset");
        let dataset = processing.as_ref();
        let dataset = dataset.map_or(beside, |processing| processing.dataset().to_owned());
        Self {
            monitor: rig.monitor().clone(),
            policy,
            limits,
            permits: Arc::new(Permits::new(&limits)),
            library: Arc::new(Library::new(root, dataset)),
            pictures: Arc::new(Pictures::new()),
            shutdown,
            processing,
            rig,
        }
    }
}

impl FromRef<App> for IndexPage {
    fn from_ref(_: &App) -> Self {
        page::INDEX
    }
}

impl FromRef<App> for BodyLimit {
    fn from_ref(app: &App) -> Self {
        Self {
            bytes: MAX_BODY,
            time: app.limits.body,
        }
    }
}

/// Everything that is served.
pub(super) fn router(app: &App) -> Router {
    let mut router = Router::new()
        .route("/api/v1/state", get(api::state))
        .route("/api/v1/events", get(api::events))
        .route("/api/v1/command", post(api::command))
        .route("/api/v1/preview.jpg", get(preview::picture))
        .route("/api/v1/trash", get(sessions::trash))
        .route("/api/v1/sessions", get(sessions::list))
        .merge(of_a_session())
        .route(
            "/api/v1/processing",
            get(processing::state).put(processing::configure),
        )
        .route(
            "/api/v1/processing/jobs/{number}",
            delete(processing::cancel),
        )
        .route("/api/v1/processing/editor", delete(editor::close))
        .route("/", get(relit_web::index))
        .route("/edit", get(editor::with_slash))
        .route(editor::PLACE, get(editor::page))
        .route("/edit/{*path}", any(editor::pass_on));
    for asset in &page::ASSETS {
        router = router.route(asset.path, get(async || asset.answer()));
    }
    router
        .fallback(no_such_path)
        .method_not_allowed_fallback(no_such_method)
        .layer(from_fn_with_state(app.clone(), guard))
        .with_state(app.clone())
}

fn of_a_session() -> Router<App> {
    let path = |rest: &str| format!("/api/v1/sessions/{{id}}{rest}");
    Router::new()
        .route(
            &path(""),
            get(sessions::detail).delete(sessions::move_to_trash),
        )
        .route(&path("/restore"), post(sessions::restore))
        .route(&path("/remarks"), put(sessions::annotate))
        .route(&path("/mask.png"), get(files::mask))
        .route(&path("/thumbnail.jpg"), get(sessions::thumbnail))
        .route(&path("/frames/{frame}"), get(sessions::frame))
        .route(&path("/video"), get(files::video))
        .route(&path("/shard.tar"), get(files::shard))
        .route(&path("/process"), post(processing::process))
        .route(&path("/check.html"), get(processing::check_page))
        .route(&path("/report.html"), get(processing::report_page))
        .route(&path("/edit"), post(editor::open))
}

async fn no_such_path(request: Request) -> Failure {
    let path = request.uri().path();
    Failure::not_found(format!("{path} does not exist: the manual lists all paths"))
}

async fn no_such_method(request: Request) -> Failure {
    let (method, path) = (request.method(), request.uri().path());
    let error = format!("{path} does not take {method}: the manual lists all methods");
    Failure::new(StatusCode::METHOD_NOT_ALLOWED, error)
}
