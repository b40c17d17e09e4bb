//! The program `relit-mask`. Masks of images alone are tested in `tests/grabcut`.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test fails by a panic, in its helpers too"
)]

mod browser;
mod check;
mod degenerate;
mod editing;
mod editor;
mod engine;
mod folders;
mod names;
#[cfg(feature = "networks")]
mod networks;
mod photographs;
mod program;
mod support;
