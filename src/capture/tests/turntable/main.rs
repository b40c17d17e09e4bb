//! The turntable as a whole: the host's side against the firmware, simulated and emulated.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout
)]

mod commands;
mod emergency;
mod emulated;
mod exchanges;
mod rig;
mod turns;
