//! Requests' JSON bodies and queries, bounded in size and time, with errors in words.

use std::time::Duration;

use axum::body::to_bytes;
use axum::extract::{FromRef, FromRequest, FromRequestParts, Query, Request};
use axum::http::{HeaderMap, StatusCode, header};
use serde::de::DeserializeOwned;
use tokio::time::timeout;

use crate::failure::Failure;

/// So many times the largest body is read and thrown away, so that the sender of one that is too large
/// gets to read the answer; a connection that is closed on unread data would lose it.
const READ_AWAY: usize = 4;

/// What a request's body may take up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BodyLimit {
    /// Most bytes.
    pub bytes: usize,
    /// Time in which it has to come.
    pub time: Duration,
}

/// The limit on a sketch of an object: some hundred thousand points.
pub const SKETCH_LIMIT: BodyLimit = BodyLimit {
    bytes: 4 << 20,
    time: Duration::from_secs(20),
};

/// A JSON body.
pub struct JsonBody<T>(pub T);

impl<S: Sync, T: DeserializeOwned> FromRequest<S> for JsonBody<T>
where
    BodyLimit: FromRef<S>,
{
    type Rejection = Failure;

    async fn from_request(request: Request, state: &S) -> Result<Self, Failure> {
        if !is_json(request.headers()) {
            let error = "the body has to be JSON: send it with \"Content-Type: application/json\"";
            return Err(Failure::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, error));
        }
        let limit = BodyLimit::from_ref(state);
        let body = to_bytes(request.into_body(), limit.bytes.saturating_mul(READ_AWAY));
        let read = timeout(limit.time, body).await;
        let read = read.map_err(|_| {
            let error = format!(
                "the body did not come within {} s",
                limit.time.as_secs_f64()
            );
            Failure::new(StatusCode::REQUEST_TIMEOUT, error)
        })?;
        // A body that broke off has nobody left to read the answer.
        let bytes = read.ok().filter(|bytes| bytes.len() <= limit.bytes);
        let bytes = bytes.ok_or_else(|| {
            let error = format!("the body is larger than {} bytes", limit.bytes);
            Failure::new(StatusCode::PAYLOAD_TOO_LARGE, error)
        })?;
        let value = serde_json::from_slice(&bytes);
        value.map(Self).map_err(|error| {
            Failure::bad_request(format!("the body cannot be understood: {error}"))
        })
    }
}

/// No web page can send this to another site's server without asking that server first.
fn is_json(headers: &HeaderMap) -> bool {
    let kind = headers.get(header::CONTENT_TYPE);
    let kind = kind.and_then(|kind| kind.to_str().ok()).unwrap_or("");
    let kind = kind.split(';').next().unwrap_or("").trim();
    kind.eq_ignore_ascii_case("application/json")
}

/// The values in the URL's query.
#[derive(FromRequestParts)]
#[from_request(via(Query), rejection(Failure))]
pub struct QueryParams<T>(pub T);
