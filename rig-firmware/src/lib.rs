//! The core of the turntable's firmware.
#![no_std]

pub mod board;
pub mod checked;
pub mod controller;
pub mod crc;
pub mod dollar;
pub mod error;
pub mod gcode;
pub mod homing;
pub mod line;
pub mod number;
pub mod ramp;
pub mod realtime;
pub mod report;
pub mod settings;
pub mod stepper;
pub mod store;
