//! What a simulated table is like.

use super::faults::TableFaults;
use relit_data::clock::Clock;

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
