//! What the page asks for: the recording, its frames, the mask of a sketch, and that it be written.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use axum::extract::{FromRef, Path, State};
use axum::http::{StatusCode, header};
use axum::middleware::from_fn_with_state;
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use relit_data::causes::with_causes;
use relit_data::geometry::Rect;
use relit_grabcut::{Effort, Warning, outline};
use relit_video::VideoError;
use relit_web::{AccessPolicy, BodyLimit, Failure, Index, JsonBody, QueryParams, Shutdown, guard};
use serde::{Deserialize, Serialize};
use tokio::sync::Semaphore;
use tokio::task::spawn_blocking;

use super::super::{MaskRecord, MaskingError};
use super::page;
use super::session::{Description, EditorSession, Sketch};

/// Largest sketch: some hundred thousand points.
const BODY: BodyLimit = BodyLimit {
    bytes: 4 << 20,
    time: Duration::from_secs(20),
};
/// Frames decoded, and masks cut, at once.
const AT_ONCE: usize = 2;
/// Widest picture of a frame that can be asked for, pixels.
const WIDEST: u32 = 8192;

/// What all requests share.
#[derive(Clone, FromRef)]
pub(super) struct App {
    session: Arc<EditorSession>,
    policy: Arc<AccessPolicy>,
    shutdown: Shutdown,
    accepted: Arc<Mutex<Option<MaskRecord>>>,
    permits: Arc<Semaphore>,
}

impl App {
    pub(super) fn new(
        session: Arc<EditorSession>,
        policy: Arc<AccessPolicy>,
        shutdown: Shutdown,
    ) -> Self {
        Self {
            session,
            policy,
            shutdown,
            accepted: Arc::default(),
            permits: Arc::new(Semaphore::new(AT_ONCE)),
        }
    }

    /// The record of the mask that was written.
    pub(super) fn accepted(&self) -> Option<MaskRecord> {
        let accepted = self.accepted.lock();
        accepted.unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Works on the recording, on a thread for it.
    async fn work<T: Send + 'static>(
        &self,
        job: impl FnOnce(&EditorSession) -> Result<T, MaskingError> + Send + 'static,
    ) -> Result<T, Failure> {
        let broken = || Failure::broken("the request could not be worked on");
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

impl FromRef<App> for Index {
    fn from_ref(_: &App) -> Self {
        page::INDEX
    }
}

impl FromRef<App> for BodyLimit {
    fn from_ref(_: &App) -> Self {
        BODY
    }
}

/// Everything that is served.
pub(super) fn router(app: &App) -> Router {
    let mut router = Router::new()
        .route("/", get(relit_web::index))
        .route("/api/v1/recording", get(recording))
        .route("/api/v1/frames/{number}", get(frame))
        .route("/api/v1/mask", post(mask))
        .route("/api/v1/accept", post(accept))
        .route("/api/v1/discard", post(discard));
    for asset in &page::ASSETS {
        router = router.route(asset.path, get(async || asset.answer()));
    }
    router
        .fallback(async || Failure::not_found("there is nothing at this path"))
        .layer(from_fn_with_state(app.clone(), guard))
        .with_state(app.clone())
}

fn failure(error: MaskingError) -> Failure {
    let status = match &error {
        MaskingError::Mask(_) => StatusCode::UNPROCESSABLE_ENTITY,
        MaskingError::Video(VideoError::NoSuchFrame { .. }) => StatusCode::NOT_FOUND,
        MaskingError::Handmade(_) | MaskingError::ForeignFile { .. } => StatusCode::CONFLICT,
        _ => StatusCode::INTERNAL_SERVER_ERROR,
    };
    Failure::new(status, with_causes(&error))
}

async fn recording(State(session): State<Arc<EditorSession>>) -> Json<Description> {
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
    let width = width.unwrap_or(WIDEST).clamp(1, WIDEST);
    let jpeg = app.work(move |session| session.jpeg(number, width)).await?;
    let headers = [
        (header::CONTENT_TYPE, "image/jpeg"),
        (header::CACHE_CONTROL, "private, max-age=3600"),
    ];
    Ok((headers, jpeg).into_response())
}

#[derive(Deserialize)]
struct Wanted {
    #[serde(default)]
    draft: bool,
}

/// The mask of a sketch, for showing it.
#[derive(Serialize)]
struct Shown {
    /// Polygons, to be filled by the even-odd rule.
    outline: Vec<Vec<[u32; 2]>>,
    area_px: u64,
    bounding_box: Rect,
    warnings: Vec<String>,
    /// Whether accepting writes just this mask.
    exact: bool,
    /// How long the cut took.
    ms: u64,
}

async fn mask(
    State(app): State<App>,
    QueryParams(Wanted { draft }): QueryParams<Wanted>,
    JsonBody(sketch): JsonBody<Sketch>,
) -> Result<Json<Shown>, Failure> {
    let effort = if draft { Effort::Draft } else { Effort::Fine };
    let exact = !draft || app.session.is_small();
    let shown = app.work(move |session| {
        let began = Instant::now();
        let mask = session.cut(sketch, effort)?;
        Ok(Shown {
            outline: outline(mask.image()),
            area_px: mask.statistics().area_px,
            bounding_box: mask.statistics().bounding_box,
            warnings: mask.warnings().iter().map(Warning::to_string).collect(),
            exact,
            ms: began.elapsed().as_millis() as u64,
        })
    });
    Ok(Json(shown.await?))
}

/// What was written.
#[derive(Serialize)]
struct Accepted {
    area_px: u64,
    mask_blake3: String,
    warnings: Vec<String>,
}

async fn accept(
    State(app): State<App>,
    JsonBody(sketch): JsonBody<Sketch>,
) -> Result<Json<Accepted>, Failure> {
    let record = app.work(move |session| session.write(sketch)).await?;
    let accepted = Accepted {
        area_px: record.result.area_px,
        mask_blake3: record.result.mask_blake3.clone(),
        warnings: record.warnings.clone(),
    };
    *app.accepted.lock().unwrap_or_else(PoisonError::into_inner) = Some(record);
    app.shutdown.cancel();
    Ok(Json(accepted))
}

async fn discard(State(shutdown): State<Shutdown>) -> StatusCode {
    shutdown.cancel();
    StatusCode::NO_CONTENT
}
