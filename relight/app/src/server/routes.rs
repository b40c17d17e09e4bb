//! The page's files as answers: to GET and HEAD alone, with the headers of a page that loads nothing from elsewhere.

use std::sync::Arc;

use axum::Router;
use axum::extract::{FromRef, Path, State};
use axum::http::StatusCode;
use axum::http::header::{self, HeaderMap, HeaderName};
use axum::middleware::from_fn_with_state;
use axum::response::{IntoResponse, Redirect, Response};
use axum::routing::get;
use relit_web::{AccessPolicy, Failure, QueryParams, TokenQuery, guard};

use super::files::{Encoding, POLICY, PageFiles};

/// The page itself.
const INDEX: &str = "index.html";

#[derive(Clone, FromRef)]
struct Served {
    files: Arc<PageFiles>,
    policy: Arc<AccessPolicy>,
}

/// Paths that need no token: there the token in the URL becomes a cookie.
pub(super) const OPEN_PATHS: &[&str] = &["/"];

pub(super) fn router(files: PageFiles, policy: Arc<AccessPolicy>) -> Router {
    let served = Served {
        files: Arc::new(files),
        policy: Arc::clone(&policy),
    };
    Router::new()
        .route("/", get(index))
        .route("/{name}", get(file))
        .fallback(|| async { Failure::not_found("file not found") })
        .layer(from_fn_with_state(policy, guard))
        .with_state(served)
}

/// The page. A token in the URL becomes a cookie, and the URL is opened again without it.
async fn index(
    State(files): State<Arc<PageFiles>>,
    State(policy): State<Arc<AccessPolicy>>,
    QueryParams(entry): QueryParams<TokenQuery>,
    headers: HeaderMap,
) -> Response {
    let home = || Redirect::to("./").into_response();
    match entry.token() {
        Some(given) => match policy.cookie_for(given) {
            Some(cookie) => ([(header::SET_COOKIE, cookie)], home()).into_response(),
            None if policy.is_open() => home(),
            None => refused(),
        },
        None if policy.is_authorised(&headers) => answer(&files, INDEX, &headers),
        None => refused(),
    }
}

async fn file(
    State(files): State<Arc<PageFiles>>,
    Path(name): Path<String>,
    headers: HeaderMap,
) -> Response {
    answer(&files, &name, &headers)
}

fn refused() -> Response {
    let error = "this needs the token: open the address that was printed at the start";
    Failure::new(StatusCode::UNAUTHORIZED, error).into_response()
}

fn answer(files: &PageFiles, name: &str, headers: &HeaderMap) -> Response {
    let accept = headers.get_all(header::ACCEPT_ENCODING);
    let accept: Vec<_> = accept
        .iter()
        .filter_map(|value| value.to_str().ok())
        .collect();
    let file = files.get(name);
    let found = file.and_then(|file| Some((file.kind, file.accepted(&accept.join(","))?)));
    let Some((
        kind,
        Encoding {
            coding,
            content,
            tag,
        },
    )) = found
    else {
        return Failure::not_found("file not found").into_response();
    };
    let about = [
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::ETAG, tag),
        (header::VARY, "accept-encoding"),
        // Asked for again each time, and not sent again where it is the same.
        (header::CACHE_CONTROL, "no-cache"),
        (
            HeaderName::from_static("cross-origin-embedder-policy"),
            "require-corp",
        ),
    ];
    let known = headers.get(header::IF_NONE_MATCH);
    if known.is_some_and(|known| known.as_bytes() == tag.as_bytes()) {
        return (StatusCode::NOT_MODIFIED, about).into_response();
    }
    let kind = [(header::CONTENT_TYPE, kind)];
    let coding = coding.map(|coding| [(header::CONTENT_ENCODING, coding)]);
    (about, kind, coding, content.clone()).into_response()
}
