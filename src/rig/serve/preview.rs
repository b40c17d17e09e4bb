//! The newest picture: as a file, and as a stream in which each part replaces the one before.

use std::sync::Arc;
use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::{HeaderName, StatusCode, header};
use axum::response::{IntoResponse, Response};
use futures_util::future::ready;
use futures_util::{StreamExt, stream};
use serde::Deserialize;
use tokio::time::timeout;
use tokio_stream::wrappers::WatchStream;
use utoipa::IntoParams;

use super::permits::{Permits, permit};
use crate::state::{Monitor, PreviewFrame};
use relit_web::Shutdown;
use relit_web::{Failure, Problem, QueryParams};

/// Shortest time between two pictures of a stream: 15 a second.
const PERIOD: Duration = Duration::from_millis(66);
/// Longest wait for a picture that is newer than the client's.
const WAIT: Duration = Duration::from_secs(4);
/// Carries a picture's number.
const NUMBER: HeaderName = HeaderName::from_static("relit-frame");
const VIEWERS: &str = "viewers of the preview";

/// Which picture is wanted.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub(super) struct After {
    /// The number of the picture that the client has: the answer waits up to 4 s for another one.
    after: Option<u64>,
}

/// The newest picture
///
/// Its number is in the header `relit-frame`. With `after`, the answer comes when there is another
/// picture than that one: asking again and again gives a stream at the client's own pace.
#[utoipa::path(
    get, path = "/api/v1/preview.jpg", tag = "preview", params(After),
    responses(
        (status = 200, description = "A JPEG file", content_type = "image/jpeg"),
        (status = 204, description = "No newer picture within 4 s"),
        (status = 401, body = Problem),
        (status = 503, description = "No picture yet, or too many viewers", body = Problem),
    )
)]
pub(super) async fn picture(
    State(monitor): State<Monitor>,
    State(permits): State<Arc<Permits>>,
    State(shutdown): State<Shutdown>,
    QueryParams(After { after }): QueryParams<After>,
) -> Result<Response, Failure> {
    let Some(after) = after else {
        let none = || Failure::busy("there is no picture yet: the camera has not delivered one");
        return Ok(jpeg(monitor.preview().ok_or_else(none)?));
    };
    let _permit = permit(&permits.viewers, VIEWERS)?;
    let mut pictures = monitor.pictures();
    let newer = pictures.wait_for(|picture| {
        let number = picture.as_ref().map(|picture| picture.number);
        number.is_some_and(|number| number != after)
    });
    let newer = shutdown.run_until_cancelled(timeout(WAIT, newer)).await;
    let newer = newer.and_then(|waited| waited.ok()?.ok()?.clone());
    Ok(newer.map_or_else(|| StatusCode::NO_CONTENT.into_response(), jpeg))
}

fn jpeg(picture: PreviewFrame) -> Response {
    let headers = [
        (header::CONTENT_TYPE, "image/jpeg".to_owned()),
        (NUMBER, picture.number.to_string()),
    ];
    (headers, Bytes::from_owner(picture.jpeg)).into_response()
}

/// The preview as Motion JPEG
///
/// `multipart/x-mixed-replace` of the newest picture, at most 15 a second. A viewer that reads slowly
/// skips pictures.
#[utoipa::path(
    get, path = "/api/v1/preview.mjpg", tag = "preview",
    responses(
        (status = 200, description = "JPEG files without end", content_type = "multipart/x-mixed-replace"),
        (status = 401, body = Problem),
        (status = 503, description = "Too many viewers", body = Problem),
    )
)]
pub(super) async fn stream(
    State(monitor): State<Monitor>,
    State(permits): State<Arc<Permits>>,
    State(shutdown): State<Shutdown>,
) -> Result<Response, Failure> {
    let permit = permit(&permits.viewers, VIEWERS)?;
    let pictures = WatchStream::new(monitor.pictures());
    let pictures = tokio_stream::StreamExt::throttle(pictures, PERIOD);
    let parts = pictures.filter_map(move |picture| {
        let _held = &permit;
        ready(picture.map(|picture| Ok(part(&picture.jpeg))))
    });
    // The boundary that ends a part is sent with it, so that the browser shows it at once.
    let opening = stream::iter([Ok::<_, axum::Error>(Bytes::from_static(b"--picture\r\n"))]);
    let body = opening.chain(parts).take_until(shutdown.cancelled_owned());
    let kind = "multipart/x-mixed-replace; boundary=picture";
    Ok(([(header::CONTENT_TYPE, kind)], Body::from_stream(body)).into_response())
}

/// A part of the stream, with the boundary that ends it.
fn part(jpeg: &[u8]) -> Bytes {
    let length = jpeg.len();
    let head = format!("Content-Type: image/jpeg\r\nContent-Length: {length}\r\n\r\n");
    [head.as_bytes(), jpeg, b"\r\n--picture\r\n"]
        .concat()
        .into()
}
