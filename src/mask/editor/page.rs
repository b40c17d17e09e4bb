//! The editor's page: a few files that are part of the program.

use relit_web::{Index, PageAsset, SCRIPT, STYLE, asset};

/// The page itself.
pub(super) const INDEX: Index = Index(include_str!("page/index.html"));

/// All files but the page itself.
pub(super) const ASSETS: [PageAsset; 5] = [
    asset("/editor.css", STYLE, include_str!("page/editor.css")),
    asset("/editor.js", SCRIPT, include_str!("page/editor.js")),
    asset("/history.js", SCRIPT, include_str!("page/history.js")),
    asset("/view.js", SCRIPT, include_str!("page/view.js")),
    asset("/icon.svg", "image/svg+xml", include_str!("page/icon.svg")),
];

/// The paths of the page and its files, which hold nothing of the recording and need no token.
pub(super) fn paths() -> Vec<&'static str> {
    let assets = ASSETS.iter().map(|asset| asset.path);
    assets.chain(["/"]).collect()
}
