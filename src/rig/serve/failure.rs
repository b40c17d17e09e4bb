//! Answers that are not what was asked for: a status and a sentence.

use axum::Json;
use axum::extract::rejection::QueryRejection;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;

use crate::serve::rig::Refused;

/// Why a request was not served.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{error}")]
pub(super) struct Failure {
    pub(super) status: StatusCode,
    error: String,
}

/// What the client gets to read.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct Problem {
    /// What failed, on what, what to do.
    #[schema(example = "a capture is under way: stop it first")]
    error: String,
}

impl Failure {
    pub(super) fn new(status: StatusCode, error: impl Into<String>) -> Self {
        Self {
            status,
            error: error.into(),
        }
    }

    pub(super) fn bad(error: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, error)
    }

    pub(super) fn not_found(error: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, error)
    }

    pub(super) fn busy(error: impl Into<String>) -> Self {
        Self::new(StatusCode::SERVICE_UNAVAILABLE, error)
    }

    pub(super) fn broken(error: impl Into<String>) -> Self {
        Self::new(StatusCode::INTERNAL_SERVER_ERROR, error)
    }
}

impl From<Refused> for Failure {
    fn from(refused: Refused) -> Self {
        let (status, error) = match refused {
            Refused::Busy(error) => (StatusCode::CONFLICT, error),
            Refused::Invalid(error) => (StatusCode::UNPROCESSABLE_ENTITY, error),
            Refused::Unavailable(error) => (StatusCode::SERVICE_UNAVAILABLE, error),
        };
        Self { status, error }
    }
}

impl From<QueryRejection> for Failure {
    fn from(query: QueryRejection) -> Self {
        Self::bad(query.body_text())
    }
}

impl IntoResponse for Failure {
    fn into_response(self) -> Response {
        let problem = Problem { error: self.error };
        let mut response = (self.status, Json(problem)).into_response();
        let headers = response.headers_mut();
        match self.status {
            StatusCode::UNAUTHORIZED => {
                headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
            }
            StatusCode::SERVICE_UNAVAILABLE => {
                headers.insert(header::RETRY_AFTER, HeaderValue::from_static("2"));
            }
            _ => {}
        }
        response
    }
}
