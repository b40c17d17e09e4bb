//! The page for a phone beside the rig: a few files that are part of the program.

use std::sync::Arc;

use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Redirect, Response};
use serde::Deserialize;

use super::access::AccessPolicy;
use super::extract::QueryParams;

const INDEX: &str = include_str!("page/index.html");

/// A file of the page.
#[derive(Debug)]
pub(super) struct Asset {
    pub(super) path: &'static str,
    pub(super) kind: &'static str,
    pub(super) text: &'static str,
}

const SCRIPT: &str = "text/javascript; charset=utf-8";

/// All files but the page itself.
pub(super) const ASSETS: [Asset; 6] = [
    asset(
        "/page.css",
        "text/css; charset=utf-8",
        include_str!("page/page.css"),
    ),
    asset("/page.js", SCRIPT, include_str!("page/page.js")),
    asset("/link.js", SCRIPT, include_str!("page/link.js")),
    asset("/preview.js", SCRIPT, include_str!("page/preview.js")),
    asset("/sessions.js", SCRIPT, include_str!("page/sessions.js")),
    asset("/icon.svg", "image/svg+xml", include_str!("page/icon.svg")),
];

const fn asset(path: &'static str, kind: &'static str, text: &'static str) -> Asset {
    Asset { path, kind, text }
}

impl Asset {
    pub(super) fn answer(&self) -> Response {
        ([(header::CONTENT_TYPE, self.kind)], self.text).into_response()
    }
}

/// The paths of the page and its files, which hold nothing of the rig and need no token.
pub(super) fn paths() -> Vec<&'static str> {
    let assets = ASSETS.iter().map(|asset| asset.path);
    assets.chain(["/"]).collect()
}

/// The token, as it stands in the address that is printed at the start.
#[derive(Debug, Deserialize)]
pub(super) struct Entry {
    token: Option<String>,
}

/// The page. With a token in the URL, the browser gets it as a cookie and goes on to the URL without it, so
/// that it stays out of history and bookmarks.
pub(super) async fn index(
    State(policy): State<Arc<AccessPolicy>>,
    QueryParams(Entry { token }): QueryParams<Entry>,
) -> Response {
    let page = [(header::CONTENT_TYPE, "text/html; charset=utf-8")];
    match token {
        None => (page, INDEX).into_response(),
        Some(given) => match policy.cookie_for(&given) {
            Some(cookie) => ([(header::SET_COOKIE, cookie)], Redirect::to("/")).into_response(),
            None if policy.is_open() => Redirect::to("/").into_response(),
            None => (StatusCode::UNAUTHORIZED, page, INDEX).into_response(),
        },
    }
}
