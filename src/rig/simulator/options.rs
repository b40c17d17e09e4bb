//! What a simulated table is like, and what it counts.

use serde::Serialize;

use super::faults::TableFaults;
use super::wire::WireCounts;
use crate::clock::Clock;

/// Options of a simulated table.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatorOptions {
    /// Its clock. Everything that works with the table needs the same one.
    pub clock: Clock,
    /// The faults to inject.
    pub faults: TableFaults,
    /// Seed of the random faults.
    pub seed: u64,
    /// Angle at which the table stands at power-on, degrees.
    pub start_angle: f64,
    /// Angle at which the index becomes active in a positive turn, degrees.
    pub index_at: f64,
    /// Range in which the index stays active, degrees.
    pub index_width: f64,
    /// Battery voltage, volts.
    pub battery: f64,
    /// Deviation of the chip's crystal from the clock, parts per million; positive is faster.
    pub drift_ppm: f64,
    /// Whether opening the port resets the chip, as it does on an Arduino.
    pub reset_on_open: bool,
}

impl Default for SimulatorOptions {
    fn default() -> Self {
        SimulatorOptions {
            clock: Clock::monotonic(),
            faults: TableFaults::default(),
            seed: 0,
            start_angle: 0.0,
            index_at: 30.0,
            index_width: 4.0,
            battery: 12.0,
            drift_ppm: 0.0,
            reset_on_open: true,
        }
    }
}

/// Counters since power-on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[non_exhaustive]
pub struct SimulatorCounts {
    /// On the way to the chip.
    pub to_chip: WireCounts,
    /// On the way from the chip.
    pub from_chip: WireCounts,
    /// How many times the port was opened.
    pub opened: u64,
    /// How many times a fault restarted the chip.
    pub resets: u64,
    /// Whether a fault stopped the chip.
    pub stalled: bool,
}
