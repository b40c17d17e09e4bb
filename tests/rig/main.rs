//! Captures with the kernel's own drivers: a camera of the test driver `vivid` or of `v4l2loopback`,
//! and a table behind a serial tty.
//!
//! These need root, `/dev/video0` (vivid), `/dev/video10` (v4l2loopback) and `/dev/ttyS1`, and take
//! the camera away under a running capture: they run only when asked, in the machine that
//! `make test-rig` starts. What each prints last is what came out.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout
)]
#![cfg(target_os = "linux")]

mod camera;
mod faults;
mod loopback;
mod portable;
mod program;
mod turn;
mod turntable;
