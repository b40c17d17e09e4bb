//! The firmware's core on a board without a chip, seen from the wire and the motor.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a panic is how a test tells"
)]

mod alarms;
mod checked;
mod commands;
mod errors;
mod homing;
mod memory;
mod motion;
mod properties;
mod settings;
