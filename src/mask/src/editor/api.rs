//! What the page asks for: the recording, its frames, the mask of a sketch, and that it be written.

use std::sync::{Arc, Mutex, PoisonError};

use axum::extract::{FromRef, Path, Request, State};
use axum::http::{StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use relit_data::causes::with_causes;
use relit_grabcut::{Effort, outline};
use relit_video::VideoError;
use relit_web::{
    BodyLimit, Failure, IndexPage, JsonBody, PageAsset, QueryParams, SCRIPT, SKETCH, SKETCH_LIMIT,
    STYLE, Shutdown, asset,
};
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::sync::Semaphore;
use tokio::task::spawn_blocking;

use super::super::{MaskRecord, MaskingError};
use super::session::{EditorSession, Sketch};

/// The page itself.
pub(crate) const INDEX: IndexPage = IndexPage(include_str!("page/index.html"));
/// Its files that are not shared with other pages.
const ASSETS: [PageAsset; 3] = [
    asset("/editor.css", STYLE, include_str!("page/editor.css")),
    asset("/editor.js", SCRIPT, include_str!("page/editor.js")),
    asset("/icon.svg", "image/svg+xml", include_str!("page/icon.svg")),
];

/// All files but the page itself.
fn assets() -> impl Iterator<Item = &'static PageAsset> {
    ASSETS.iter().chain(&SKETCH)
}

/// The paths of the page and its files, which hold nothing of the recording and need no token.
pub(super) fn page_paths() -> Vec<&'static str> {
    assets().map(|asset| asset.path).chain(["/"]).collect()
}

/// Widest picture of a frame that can be requested, pixels.
const MAX_WIDTH: u32 = 8192;

/// The record of the mask that was written.
pub(super) type Accepted = Arc<Mutex<Option<MaskRecord>>>;

/// What all requests share.
#[derive(Clone, FromRef)]
pub(super) struct App {
    pub(super) session: Arc<EditorSession>,
    pub(super) over: Shutdown,
    pub(super) accepted: Accepted,
    pub(super) permits: Arc<Semaphore>,
}

impl FromRef<App> for BodyLimit {
    fn from_ref(_: &App) -> Self {
        SKETCH_LIMIT
    }
}

impl App {
    /// Works on the recording, on a thread for it.
    async fn work<T: Send + 'static>(
        &self,
        job: impl FnOnce(&EditorSession) -> Result<T, MaskingError> + Send + 'static,
    ) -> Result<T, Failure> {
        let broken = || Failure::internal("the request could not be processed");
        let permit = self.permits.clone().acquire_owned().await;
        let permit = permit.map_err(|_| broken())?;
        let session = self.session.clone();
        let done = spawn_blocking(move || {
            let _permit = permit;
            job(&session)
        });
        done.await.map_err(|_| broken())?.map_err(failure)
    }
}

/// Everything that is served, without the page itself.
pub(super) fn router(app: App) -> Router {
    let mut router = Router::new()
        .route("/api/v1/recording", get(recording))
        .route("/api/v1/frames/{number}", get(frame))
        .route("/api/v1/mask", post(mask))
        .route("/api/v1/accept", post(accept))
        .route("/api/v1/discard", post(discard));
    for asset in assets() {
        router = router.route(asset.path, get(async || asset.answer()));
    }
    router
        .fallback(async || Failure::not_found("there is nothing at this path"))
        .layer(from_fn_with_state(app.clone(), of_this_recording))
        .with_state(app)
}

#[derive(Deserialize)]
struct Of {
    of: Option<String>,
}

/// Refuses what a page of another recording asks: the address may be the same.
async fn of_this_recording(
    State(session): State<Arc<EditorSession>>,
    QueryParams(Of { of }): QueryParams<Of>,
    request: Request,
    next: Next,
) -> Result<Response, Failure> {
    if of.is_some_and(|of| of != session.recording()) {
        let error = "another recording is open in the editor now: open this one again";
        return Err(Failure::new(StatusCode::CONFLICT, error.to_owned()));
    }
    Ok(next.run(request).await)
}

fn failure(error: MaskingError) -> Failure {
    let status = match &error {
        MaskingError::Mask(_) => StatusCode::UNPROCESSABLE_ENTITY,
        MaskingError::Video(VideoError::NoSuchFrame { .. }) => StatusCode::NOT_FOUND,
        MaskingError::Handmade(_)
        | MaskingError::IsInput(_)
        | MaskingError::ForeignFile { .. }
        | MaskingError::Refused(_) => StatusCode::CONFLICT,
        _ => StatusCode::INTERNAL_SERVER_ERROR,
    };
    Failure::new(status, with_causes(&error))
}

async fn recording(State(session): State<Arc<EditorSession>>) -> Json<Value> {
    Json(session.description())
}

#[derive(Deserialize)]
struct Width {
    width: Option<u32>,
}

async fn frame(
    State(app): State<App>,
    Path(number): Path<u64>,
    QueryParams(Width { width }): QueryParams<Width>,
) -> Result<Response, Failure> {
    let width = width.unwrap_or(MAX_WIDTH).clamp(1, MAX_WIDTH);
    let jpeg = app.work(move |session| session.jpeg(number, width)).await?;
    let headers = [
        (header::CONTENT_TYPE, "image/jpeg"),
        (header::CACHE_CONTROL, "private, max-age=3600"),
    ];
    Ok((headers, jpeg).into_response())
}

#[derive(Deserialize)]
struct MaskQuery {
    #[serde(default)]
    draft: bool,
}

/// The mask of a sketch, for showing it. The outline is polygons, to be filled by the even-odd rule.
async fn mask(
    State(app): State<App>,
    QueryParams(MaskQuery { draft }): QueryParams<MaskQuery>,
    JsonBody(sketch): JsonBody<Sketch>,
) -> Result<Json<Value>, Failure> {
    let effort = if draft { Effort::Draft } else { Effort::Fine };
    let exact = !draft || app.session.is_small();
    let shown = app.work(move |session| {
        let mask = session.cut(sketch, effort)?;
        Ok(json!({
            "outline": outline(&mask.image),
            "area_px": mask.statistics.area_px,
            "bounding_box": mask.statistics.bounding_box,
            "warnings": mask.warnings,
            // Whether accepting writes just this mask.
            "exact": exact,
        }))
    });
    Ok(Json(shown.await?))
}

async fn accept(
    State(app): State<App>,
    JsonBody(sketch): JsonBody<Sketch>,
) -> Result<Json<Value>, Failure> {
    let over = app.over.clone();
    let write = move |session: &EditorSession| session.write(sketch, || over.is_cancelled());
    let record = app.work(write).await?;
    let accepted = json!({
        "area_px": record.result.statistics.area_px,
        "mask_blake3": record.result.mask_blake3,
        "warnings": record.warnings,
    });
    *app.accepted.lock().unwrap_or_else(PoisonError::into_inner) = Some(record);
    app.over.cancel();
    Ok(Json(accepted))
}

async fn discard(State(over): State<Shutdown>) -> StatusCode {
    over.cancel();
    StatusCode::NO_CONTENT
}
