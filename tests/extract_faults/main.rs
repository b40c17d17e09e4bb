//! `relit-extract` when it is killed, when the disk is full, when files may not be read, and when several
//! tasks share the work.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr
)]

mod full_disk;
mod killed;
mod support;
mod tasks;
