//! The simulated table, and its port in memory.

use std::fmt;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::chip::{IndexInput, Pins};
use super::ground_truth::StepEdge;
use super::model::Model;
use super::options::SimulatorOptions;
use crate::Port;
use relit_data::clock::Clock;

/// Interval at which a port checks for bytes.
pub(super) const LOOK: Duration = Duration::from_micros(500);
/// Voltage at the battery input's full scale.
const BATTERY_SCALE: f64 = 15.5;
/// The converter's value at full scale.
const BATTERY_FULL: f64 = 1023.0;

/// A simulated table. Clones share it.
///
/// It has no thread: each access first simulates the time that has passed on its clock. On
/// [virtual time](Clock::virtual_time), a turn takes no longer than its simulation.
#[derive(Clone)]
pub struct SimulatedTable {
    clock: Clock,
    model: Arc<Mutex<Model>>,
    reset_on_open: bool,
}

impl fmt::Debug for SimulatedTable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SimulatedTable").finish_non_exhaustive()
    }
}

impl SimulatedTable {
    /// A table whose power comes on now.
    pub fn new(options: &SimulatorOptions) -> SimulatedTable {
        let pins = Pins {
            index: IndexInput::ByAngle,
            emergency: false,
            battery: battery_reading(options.battery),
        };
        let model = Model::new(options, pins, options.clock.now_us());
        SimulatedTable {
            clock: options.clock.clone(),
            model: Arc::new(Mutex::new(model)),
            reset_on_open: options.reset_on_open,
        }
    }

    /// Opens the table's port. This resets the chip if the options say so.
    pub fn open(&self) -> SimulatedPort {
        self.model().open(self.clock.now_us());
        SimulatedPort {
            table: self.clone(),
        }
    }

    /// The table's true angle at a time of its clock, degrees; not reduced to one turn. After the
    /// present, the table counts as standing still.
    pub fn angle_at(&self, us: i64) -> f64 {
        self.now().ground_truth().angle_at(us)
    }

    /// All steps so far, at most the last two million.
    pub fn edges(&self) -> Vec<StepEdge> {
        self.now().ground_truth().edges()
    }

    /// Fixes the level of the index input; `None`: it depends on the angle.
    pub fn hold_index(&self, level: Option<bool>) {
        let index = level.map_or(IndexInput::ByAngle, IndexInput::Held);
        self.change_pins(|pins| pins.index = index);
    }

    /// Presses or releases the emergency stop.
    pub fn press_emergency_stop(&self, pressed: bool) {
        self.change_pins(|pins| pins.emergency = pressed);
    }

    /// Sets the battery's voltage, volts.
    pub fn set_battery(&self, volts: f64) {
        self.change_pins(|pins| pins.battery = battery_reading(volts));
    }

    fn change_pins(&self, change: impl FnOnce(&mut Pins)) {
        let now_us = self.clock.now_us();
        self.model().change_pins(now_us, change);
    }

    /// The simulation at the time of the last access.
    pub(super) fn model(&self) -> MutexGuard<'_, Model> {
        self.model.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The simulation, advanced to the present.
    fn now(&self) -> MutexGuard<'_, Model> {
        let mut model = self.model();
        model.advance(self.clock.now_us());
        model
    }
}

fn battery_reading(volts: f64) -> u16 {
    (volts / BATTERY_SCALE * BATTERY_FULL)
        .round()
        .clamp(0.0, BATTERY_FULL) as u16
}

/// A port to a [`SimulatedTable`], in memory and on its clock.
pub struct SimulatedPort {
    table: SimulatedTable,
}

impl Port for SimulatedPort {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        let clock = &self.table.clock;
        let deadline_us = clock.after(wait);
        loop {
            let now_us = clock.now_us();
            let bytes = self.table.model().take_output(now_us, buffer.len());
            if let Some(place) = buffer.get_mut(..bytes.len()).filter(|_| !bytes.is_empty()) {
                place.copy_from_slice(&bytes);
                return Ok(bytes.len());
            }
            if now_us >= deadline_us {
                return Ok(0);
            }
            clock.sleep_until(deadline_us.min(clock.after(LOOK)));
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut model = self.table.model();
        if bytes.len() > model.capacity() {
            return Err(io::Error::from(io::ErrorKind::TimedOut));
        }
        model.receive(self.table.clock.now_us(), bytes);
        Ok(())
    }

    fn name(&self) -> String {
        "sim:".to_owned()
    }

    fn resets(&self) -> bool {
        self.table.reset_on_open
    }
}
