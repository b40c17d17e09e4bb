//! Camera and table, opened on one clock, and opened again after they were gone.

use std::time::Duration;

use jiff::Timestamp;

use crate::camera::{self, Camera, CameraAddress, ReplaySpeed};
use crate::clock::Clock;
use crate::simulator::{self, SimulatedTable, SimulatorOptions};
use crate::turntable::{Table, TableOptions, TurntableAddress, find_serial};

use super::error::{CaptureError, Refusal};
use super::settings::Settings;

/// How many times faster than real time a rehearsal runs at most where people look at it.
const FASTEST_SHOWN: f64 = 20.0;
/// Session names have whole seconds: two sessions begin at least so far apart.
const NAME_SPACING: Duration = Duration::from_secs(1);

/// Camera and table of a rig.
pub struct Equipment {
    // Dropped in this order: the table is stopped before its simulator is switched off.
    /// The camera; `None` while it is gone.
    pub camera: Option<Box<dyn Camera>>,
    /// The table; `None` while it is gone, and where there is none.
    pub table: Option<Table>,
    simulator: Option<SimulatedTable>,
    settings: Settings,
    clock: Clock,
    /// When the last session was named.
    named: Option<Timestamp>,
}

impl Equipment {
    /// Nothing opened yet. Camera and table go by one clock: where neither is real, by
    /// [virtual time](Clock::virtual_time), at most as fast as their addresses say.
    ///
    /// # Errors
    /// [`Refusal::Pace`].
    pub fn new(settings: Settings) -> Result<Self, Refusal> {
        let speed = settings.speed()?;
        Ok(Self::at_speed(settings, speed))
    }

    /// The same for a rig that people look at, and that runs while nothing is captured: as fast as it
    /// goes is 20 times real time.
    ///
    /// # Errors
    /// [`Refusal::Pace`].
    pub fn for_viewers(settings: Settings) -> Result<Self, Refusal> {
        let speed = match settings.speed()? {
            0.0 => FASTEST_SHOWN,
            speed => speed,
        };
        Ok(Self::at_speed(settings, speed))
    }

    fn at_speed(mut settings: Settings, speed: f64) -> Self {
        if let CameraAddress::Replay { speed, .. } = &mut settings.camera {
            // It goes as fast as the clock does.
            *speed = ReplaySpeed::Times(1.0);
        }
        let clock = match speed {
            0.0 => Clock::virtual_time(),
            1.0 => Clock::monotonic(),
            times => Clock::paced(times),
        };
        Self {
            camera: None,
            table: None,
            simulator: None,
            settings,
            clock,
            named: None,
        }
    }

    /// The settings, with the addresses as they are opened.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The clock that everything goes by.
    #[must_use]
    pub fn clock(&self) -> Clock {
        self.clock.clone()
    }

    /// The time of day for the next session's name, which has whole seconds: waits until it differs
    /// from the one before.
    pub(super) fn session_time(&mut self) -> Timestamp {
        let passed = self
            .named
            .map(|named| Timestamp::now().duration_since(named));
        let passed = passed.map_or(NAME_SPACING, |passed| passed.unsigned_abs());
        std::thread::sleep(NAME_SPACING.saturating_sub(passed));
        *self.named.insert(Timestamp::now())
    }

    /// The simulated table, where the table is one and was opened.
    #[must_use]
    pub fn simulator(&self) -> Option<&SimulatedTable> {
        self.simulator.as_ref()
    }

    /// Whether a table is to be there.
    #[must_use]
    pub fn wants_table(&self) -> bool {
        self.settings.turntable != TurntableAddress::None
    }

    /// Opens the camera where it is not.
    ///
    /// # Errors
    /// What opening it answers.
    pub fn open_camera(&mut self) -> Result<&mut dyn Camera, CaptureError> {
        let opened = match self.camera.take() {
            Some(camera) => camera,
            None => camera::open(&self.settings.camera, self.clock.clone())?,
        };
        Ok(self.camera.insert(opened).as_mut())
    }

    /// Opens the table where it is not and there is one.
    ///
    /// # Errors
    /// What opening it answers.
    pub fn open_table(&mut self) -> Result<Option<&Table>, CaptureError> {
        if self.table.is_none() {
            self.table = self.connect()?;
        }
        Ok(self.table.as_ref())
    }

    fn connect(&mut self) -> Result<Option<Table>, CaptureError> {
        let options = TableOptions {
            clock: self.clock.clone(),
            runtime_folder: self.settings.runtime_folder.clone(),
            ..TableOptions::default()
        };
        let path = match &self.settings.turntable {
            TurntableAddress::None => return Ok(None),
            TurntableAddress::Serial(Some(path)) => path.clone(),
            TurntableAddress::Serial(None) => find_serial()?,
            TurntableAddress::Simulated(address) => {
                let fault = address.fault.clone();
                let port = self.simulated(fault.as_deref())?.open();
                return Ok(Some(Table::open(port, &options)?));
            }
        };
        Ok(Some(Table::open_serial(&path, &options)?))
    }

    /// The simulated table, switched on the first time.
    fn simulated(
        &mut self,
        fault: Option<&str>,
    ) -> Result<&SimulatedTable, simulator::SimulatorError> {
        let simulator = match self.simulator.take() {
            Some(simulator) => simulator,
            None => SimulatedTable::new(&SimulatorOptions {
                clock: self.clock.clone(),
                faults: fault.unwrap_or_default().parse()?,
                ..SimulatorOptions::default()
            }),
        };
        Ok(self.simulator.insert(simulator))
    }

    /// Forgets the camera, so that it is opened again.
    pub fn drop_camera(&mut self) {
        self.camera = None;
    }

    /// Forgets the table, so that it is opened again.
    pub fn drop_table(&mut self) {
        self.table = None;
    }
}
