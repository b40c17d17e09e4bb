//! Requests' JSON bodies and queries, bounded in size and time, with errors in words.

use std::sync::Arc;

use axum::body::Body;
use axum::extract::{FromRequest, FromRequestParts, Query, Request};
use axum::http::request::Parts;
use axum::http::{HeaderMap, StatusCode, header};
use futures_util::StreamExt;
use serde::de::DeserializeOwned;
use tokio::time::timeout;

use super::answer::Failure;
use super::server::Server;

/// Largest body, bytes.
pub(super) const LARGEST: usize = 16 * 1024;
/// So much of a body that is too large is read and thrown away, so that its sender gets to read the
/// answer; a connection that is closed on unread data would lose it.
const READ_AWAY: usize = 4 * LARGEST;

/// A JSON body.
pub(super) struct Payload<T>(pub(super) T);

impl<T: DeserializeOwned> FromRequest<Arc<Server>> for Payload<T> {
    type Rejection = Failure;

    async fn from_request(request: Request, server: &Arc<Server>) -> Result<Self, Failure> {
        if !is_json(request.headers()) {
            let error = "the body has to be JSON: send it with \"Content-Type: application/json\"";
            return Err(Failure::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, error));
        }
        let limit = server.limits.body;
        let read = timeout(limit, read(request.into_body())).await;
        let bytes = read.map_err(|_| {
            let error = format!("the body did not come within {} s", limit.as_secs_f64());
            Failure::new(StatusCode::REQUEST_TIMEOUT, error)
        })??;
        let value = serde_json::from_slice(&bytes)
            .map_err(|error| Failure::bad(format!("the body cannot be understood: {error}")))?;
        Ok(Self(value))
    }
}

/// No web page can send this to another site's server without asking that server first.
fn is_json(headers: &HeaderMap) -> bool {
    let kind = headers.get(header::CONTENT_TYPE);
    let kind = kind.and_then(|kind| kind.to_str().ok()).unwrap_or("");
    let kind = kind.split(';').next().unwrap_or("").trim();
    kind.eq_ignore_ascii_case("application/json")
}

async fn read(body: Body) -> Result<Vec<u8>, Failure> {
    let mut pieces = body.into_data_stream();
    let (mut bytes, mut total) = (Vec::new(), 0_usize);
    while let Some(piece) = pieces.next().await {
        let piece = piece.map_err(|_| Failure::bad("the body broke off"))?;
        total = total.saturating_add(piece.len());
        if total <= LARGEST {
            bytes.extend_from_slice(&piece);
        } else if total > READ_AWAY {
            break;
        }
    }
    if total <= LARGEST {
        return Ok(bytes);
    }
    let error = format!("the body is larger than {LARGEST} bytes");
    Err(Failure::new(StatusCode::PAYLOAD_TOO_LARGE, error))
}

/// The values in the URL's query.
pub(super) struct Asked<T>(pub(super) T);

impl<T: DeserializeOwned + Send> FromRequestParts<Arc<Server>> for Asked<T> {
    type Rejection = Failure;

    async fn from_request_parts(parts: &mut Parts, server: &Arc<Server>) -> Result<Self, Failure> {
        let query = Query::from_request_parts(parts, server).await;
        let Query(value) = query.map_err(|error| Failure::bad(error.body_text()))?;
        Ok(Self(value))
    }
}
