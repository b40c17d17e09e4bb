//! The files of a page, which are part of the program, and the way in: the token in the URL becomes a
//! cookie.

use std::sync::Arc;

use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Redirect, Response};
use serde::Deserialize;

use crate::access::AccessPolicy;
use crate::request_body::QueryParams;

/// The content type of a script.
pub const SCRIPT: &str = "text/javascript; charset=utf-8";
/// The content type of a style sheet.
pub const STYLE: &str = "text/css; charset=utf-8";

/// A file of a page.
#[derive(Debug)]
pub struct PageAsset {
    /// Its path in the URL.
    pub path: &'static str,
    /// Its content type.
    pub kind: &'static str,
    /// Its content.
    pub text: &'static str,
}

/// A file at `path` of the content type `kind`.
pub const fn asset(path: &'static str, kind: &'static str, text: &'static str) -> PageAsset {
    PageAsset { path, kind, text }
}

/// What pages share on which a person sketches where an object is: `sketcher.js` over a canvas, and its style. The app's
/// build takes the same files.
pub const SKETCH: [PageAsset; 4] = [
    asset("/sketch.css", STYLE, include_str!("sketch.css")),
    asset("/sketcher.js", SCRIPT, include_str!("sketcher.js")),
    asset("/sketch-view.js", SCRIPT, include_str!("sketch-view.js")),
    asset("/history.js", SCRIPT, include_str!("history.js")),
];

impl PageAsset {
    /// The file as an answer.
    pub fn answer(&self) -> Response {
        ([(header::CONTENT_TYPE, self.kind)], self.text).into_response()
    }
}

/// The token, as it stands in the address that is printed at the start.
#[derive(Debug, Deserialize)]
pub struct TokenQuery {
    token: Option<String>,
}

impl TokenQuery {
    /// The token, where the URL has one.
    pub fn token(&self) -> Option<&str> {
        self.token.as_deref()
    }
}

/// The page itself.
#[derive(Debug, Clone, Copy)]
pub struct IndexPage(pub &'static str);

/// The page at `/`. With a token in the URL, the browser gets it as a cookie and continues to the URL
/// without it, so that it stays out of history and bookmarks.
pub async fn index(
    State(policy): State<Arc<AccessPolicy>>,
    State(IndexPage(text)): State<IndexPage>,
    QueryParams(TokenQuery { token }): QueryParams<TokenQuery>,
) -> Response {
    let page = [(header::CONTENT_TYPE, "text/html; charset=utf-8")];
    match token {
        None => (page, text).into_response(),
        Some(given) => match policy.cookie_for(&given) {
            Some(cookie) => ([(header::SET_COOKIE, cookie)], Redirect::to("/")).into_response(),
            None if policy.is_open() => Redirect::to("/").into_response(),
            None => (StatusCode::UNAUTHORIZED, page, text).into_response(),
        },
    }
}
