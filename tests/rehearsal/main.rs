//! Whole captures without hardware: a replayed camera and a simulated table on virtual time.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test that cannot go on has failed, and its child talks to it"
)]

mod commands;
mod daemon;
mod faults;
mod killed;
mod serving;
mod support;
mod turn;
