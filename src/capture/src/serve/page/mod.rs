//! The page for a phone beside the rig: a few files that are part of the program.

use relit_web::{IndexPage, PageAsset, SCRIPT, STYLE, asset};

/// The page itself.
pub(super) const INDEX: IndexPage = IndexPage(include_str!("index.html"));

/// All files but the page itself.
pub(super) const ASSETS: [PageAsset; 8] = [
    asset("/page.css", STYLE, include_str!("page.css")),
    asset("/page.js", SCRIPT, include_str!("page.js")),
    asset("/link.js", SCRIPT, include_str!("link.js")),
    asset("/elements.js", SCRIPT, include_str!("elements.js")),
    asset("/process.js", SCRIPT, include_str!("process.js")),
    asset("/preview.js", SCRIPT, include_str!("preview.js")),
    asset("/sessions.js", SCRIPT, include_str!("sessions.js")),
    asset("/icon.svg", "image/svg+xml", include_str!("icon.svg")),
];

/// The paths of the page and its files, which hold nothing of the rig and need no token.
pub(super) fn paths() -> Vec<&'static str> {
    let assets = ASSETS.iter().map(|asset| asset.path);
    assets.chain(["/"]).collect()
}
