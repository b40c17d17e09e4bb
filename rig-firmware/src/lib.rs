//! The core of the turntable's firmware.
#![no_std]

pub mod board;
pub mod controller;
pub mod realtime;
pub mod stepper;
