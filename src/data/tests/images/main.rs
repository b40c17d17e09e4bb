//! Still images as the world makes them: their formats, colours, orientations and endings. All files are made here, but
//! for one progressive JPEG, which nothing in the workspace writes.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

mod colours;
mod endings;
mod files;
mod forms;
