//! Which path leads where, and what the handlers share.

use std::sync::Arc;

use axum::extract::{FromRef, Request};
use axum::http::StatusCode;
use axum::middleware::from_fn_with_state;
use axum::routing::{any, get};
use axum::{Json, Router};
use utoipa::OpenApi as _;
use utoipa::openapi::security::{HttpAuthScheme, HttpBuilder, SecurityRequirement, SecurityScheme};
use utoipa::openapi::{Components, InfoBuilder, OpenApi, OpenApiBuilder};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use super::library::Library;
use super::metrics::Responses;
use super::options::ClientLimits;
use super::permits::Permits;
use super::pictures::Pictures;
use super::processing::MayProcess;
use super::rig::Rig;
use super::snapshots::Snapshots;
use super::{api, editor, files, metrics, page, preview, processing, sessions};
use crate::state::Monitor;
use relit_web::Shutdown;
use relit_web::{AccessPolicy, BodyLimit, Failure, Index, guard};

/// Largest body of a request, bytes.
const LARGEST_BODY: usize = 16 * 1024;

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
    pub(super) processing: MayProcess,
}

impl App {
    pub(super) fn new(
        rig: Arc<dyn Rig>,
        policy: AccessPolicy,
        limits: ClientLimits,
        shutdown: Shutdown,
        processing: MayProcess,
    ) -> Self {
        let root = rig.root().to_owned();
        let beside = root.with_file_name("dataset");
        let worker = processing.clone();
        let dataset = move || worker.as_ref().map_or(beside.clone(), |it| it.dataset());
        Self {
            monitor: rig.monitor().clone(),
            snapshots: Snapshots::new(rig.monitor()),
            policy: Arc::new(policy),
            limits,
            permits: Arc::new(Permits::new(&limits)),
            library: Arc::new(Library::new(root, Box::new(dataset))),
            pictures: Arc::new(Pictures::new()),
            responses: Arc::default(),
            shutdown,
            processing,
            rig,
        }
    }
}

impl FromRef<App> for Index {
    fn from_ref(_: &App) -> Self {
        page::INDEX
    }
}

impl FromRef<App> for BodyLimit {
    fn from_ref(app: &App) -> Self {
        Self {
            bytes: LARGEST_BODY,
            time: app.limits.body,
        }
    }
}

/// The interface for programs, with its description.
pub(super) fn interface() -> OpenApiRouter<App> {
    OpenApiRouter::with_openapi(description())
        .routes(routes!(api::state))
        .routes(routes!(api::events))
        .routes(routes!(api::command))
        .routes(routes!(preview::picture))
        .routes(routes!(preview::stream))
        .routes(routes!(sessions::list))
        .routes(routes!(sessions::detail, sessions::put_away))
        .routes(routes!(sessions::restore))
        .routes(routes!(sessions::trash))
        .routes(routes!(sessions::remark))
        .routes(routes!(files::day_tar))
        .routes(routes!(files::mask))
        .routes(routes!(sessions::thumbnail))
        .routes(routes!(sessions::frame))
        .routes(routes!(sessions::objects))
        .routes(routes!(files::video))
        .routes(routes!(processing::state, processing::configure))
        .routes(routes!(processing::process))
        .routes(routes!(processing::verify))
        .routes(routes!(processing::cancel))
        .routes(routes!(processing::check_page))
        .routes(routes!(processing::report_page))
        .routes(routes!(editor::open))
        .routes(routes!(editor::close))
        .routes(routes!(metrics::metrics))
        .routes(routes!(document))
}

/// This description
#[utoipa::path(
    get, path = "/api/v1/openapi.json", tag = "description",
    responses((status = 200, description = "OpenAPI 3.1", content_type = "application/json"))
)]
async fn document() -> Json<OpenApi> {
    Json(interface().into_openapi())
}

/// What the description says besides the paths.
fn description() -> OpenApi {
    let token = HttpBuilder::new()
        .scheme(HttpAuthScheme::Bearer)
        .description(Some("Demanded on every address but loopback."))
        .build();
    let mut components = Components::new();
    components.add_security_scheme("token", SecurityScheme::Http(token));
    let none: [&str; 0] = [];
    OpenApiBuilder::new()
        .info(
            InfoBuilder::new()
                .title("relit-capture")
                .version(env!("CARGO_PKG_VERSION"))
                .description(Some(
                    "A turntable rig: its state, commands to it, and what it recorded.",
                ))
                .build(),
        )
        .components(Some(components))
        .security(Some([SecurityRequirement::new("token", none)]))
        .paths(TarPath::openapi().paths)
        .build()
}

/// The path that the router has in common with that of a session.
#[derive(utoipa::OpenApi)]
#[openapi(paths(files::session_tar))]
struct TarPath;

/// Everything that is served.
pub(super) fn router(app: &App) -> Router {
    let mut router = Router::from(interface())
        .route("/", get(relit_web::index))
        .route("/edit", get(editor::with_slash))
        .route(editor::PLACE, get(editor::pass_on))
        .route("/edit/{*path}", any(editor::pass_on));
    for asset in &page::ASSETS {
        router = router.route(asset.path, get(async || asset.answer()));
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
