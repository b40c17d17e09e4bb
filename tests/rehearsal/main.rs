//! Whole captures without hardware: a replayed camera and a simulated table on one clock, five
//! times as fast as real time.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod daemon;
mod faults;
mod support;
mod turn;
