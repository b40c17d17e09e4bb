//! The core of the turntable's firmware: Grbl 1.1's serial interface and stepper motion on one
//! axis, without a chip.
//!
//! The same code runs on the board and in the simulator: no allocation, no floating point, no
//! dependencies. A board lends it a chip through [`board::Board`], calls
//! [`stepper::Stepper::fire`] from its step timer and [`controller::Controller::poll`] for ever.
//! One millimetre of Grbl is one degree here; angles inside are whole thousandths of a degree.
//!
//! | module | what it is for | knows |
//! | --- | --- | --- |
//! | [`crc`], `number`, `error`, [`realtime`] | checksum, decimals, error numbers, commands of one byte | nobody |
//! | `line` | bytes to lines | `crc` |
//! | `checked` | sequence numbers: what to do with a line | `line`, `error` |
//! | `ramp` | speed as a number of steps from standstill | nobody |
//! | `search` | the index, found to one step | nobody |
//! | [`stepper`] | moves to step intervals, in the interrupt | `ramp`, `search`, `realtime` |
//! | [`board`] | what the core needs of a chip | `stepper` |
//! | `settings`, `store` | the `$` settings; keeping them in the EEPROM | `board`, `ramp`, `number`, `crc` |
//! | `gcode`, `dollar` | text to typed commands | `number`, `settings`, `error` |
//! | `homing` | the way to the index, as a state machine | `settings` |
//! | `report` | text and numbers to the line | `board`, `crc`, `settings` |
//! | [`controller`] | states, plans, answers: the main loop | all of them |
//!
//! What interrupts do is in `stepper` and `realtime` alone; all else runs in the main loop.
#![no_std]
#![allow(
    clippy::new_without_default,
    reason = "boards build statics, which need constant functions"
)]

pub mod board;
mod checked;
pub mod controller;
pub mod crc;
mod dollar;
mod error;
mod gcode;
mod homing;
mod line;
mod number;
mod ramp;
pub mod realtime;
mod report;
mod search;
mod settings;
pub mod stepper;
mod store;
