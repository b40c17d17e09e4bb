//! Requests' JSON bodies and queries, bounded in size and time, with errors in words.

use axum::body::to_bytes;
use axum::extract::{FromRef, FromRequest, FromRequestParts, Query, Request};
use axum::http::{HeaderMap, StatusCode, header};
use serde::de::DeserializeOwned;
use tokio::time::timeout;

use super::failure::Failure;
use super::options::ClientLimits;

/// Largest body, bytes.
const LARGEST: usize = 16 * 1024;
/// So much of a body that is too large is read and thrown away, so that its sender gets to read the
/// answer; a connection that is closed on unread data would lose it.
const READ_AWAY: usize = 4 * LARGEST;

/// A JSON body.
pub(super) struct JsonBody<T>(pub(super) T);

impl<S: Sync, T: DeserializeOwned> FromRequest<S> for JsonBody<T>
where
    ClientLimits: FromRef<S>,
{
    type Rejection = Failure;

    async fn from_request(request: Request, state: &S) -> Result<Self, Failure> {
        if !is_json(request.headers()) {
            let error = "the body has to be JSON: send it with \"Content-Type: application/json\"";
            return Err(Failure::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, error));
        }
        let limit = ClientLimits::from_ref(state).body;
        let read = timeout(limit, to_bytes(request.into_body(), READ_AWAY)).await;
        let read = read.map_err(|_| {
            let error = format!("the body did not come within {} s", limit.as_secs_f64());
            Failure::new(StatusCode::REQUEST_TIMEOUT, error)
        })?;
        // A body that broke off has nobody left to read the answer.
        let bytes = read.ok().filter(|bytes| bytes.len() <= LARGEST);
        let bytes = bytes.ok_or_else(|| {
            let error = format!("the body is larger than {LARGEST} bytes");
            Failure::new(StatusCode::PAYLOAD_TOO_LARGE, error)
        })?;
        let value = serde_json::from_slice(&bytes);
        value
            .map(Self)
            .map_err(|error| Failure::bad(format!("the body cannot be understood: {error}")))
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
pub(super) struct QueryParams<T>(pub(super) T);
