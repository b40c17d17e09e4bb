//! The newest picture, at once or when there is a newer one.

use std::sync::Arc;
use std::time::Duration;

use axum::body::Bytes;
use axum::extract::State;
use axum::http::{HeaderName, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use tokio::time::timeout;

use super::permits::{Permits, permit};
use crate::state::{Monitor, PreviewFrame};
use relit_web::Shutdown;
use relit_web::{Failure, QueryParams};

/// Longest wait for a picture that is newer than the client's.
const WAIT: Duration = Duration::from_secs(4);
/// Carries a picture's number.
const NUMBER: HeaderName = HeaderName::from_static("relit-frame");

/// Which picture is wanted.
#[derive(Debug, Deserialize)]
pub(super) struct PreviewQuery {
    /// The number of the picture that the client has: the answer waits up to 4 s for another one.
    after: Option<u64>,
}

/// The newest picture
///
/// Its number is in the header `relit-frame`. With `after`, the answer comes when there is another
/// picture than that one: asking again and again gives a stream at the client's own pace.
pub(super) async fn picture(
    State(monitor): State<Monitor>,
    State(permits): State<Arc<Permits>>,
    State(shutdown): State<Shutdown>,
    QueryParams(PreviewQuery { after }): QueryParams<PreviewQuery>,
) -> Result<Response, Failure> {
    let Some(after) = after else {
        let none = || Failure::unavailable("no picture yet: the camera has not delivered one");
        return Ok(jpeg(monitor.preview().ok_or_else(none)?));
    };
    let _permit = permit(&permits.viewers, "viewers of the preview")?;
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
