//! Masks from outside: on images, and by the program on recordings.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of tests may fail loudly"
)]

mod images;
mod program;
mod scene;
