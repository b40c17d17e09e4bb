//! Masks from outside: on images, and by the program on recordings.
#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::panic,
    reason = "helpers of tests may fail loudly, and the scene serves the library's tests too"
)]

mod program;
mod scene;
