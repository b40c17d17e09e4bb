//! Whole captures without hardware: a replayed camera and a simulated table on virtual time.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod commands;
mod daemon;
mod faults;
mod serving;
mod support;
mod turn;
