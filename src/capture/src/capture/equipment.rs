//! Camera and table, opened on one clock, and opened again after they were gone.

use std::time::Duration;

use jiff::Timestamp;

use super::error::CaptureError;
use super::manifest::session_name;
use super::settings::Settings;
use relit_camera::{self as camera, Camera};
use relit_data::clock::Clock;
use relit_turntable::simulator::{SimulatedTable, SimulatorOptions};
use relit_turntable::{Table, TableOptions, TurntableAddress, find_serial};

/// How many times faster than real time a rehearsal runs at most where people look at it.
const FASTEST_SHOWN: f64 = 20.0;
/// Time between two looks whether a session's name, which has whole seconds, is free.
const NAME_LOOK: Duration = Duration::from_millis(100);

/// Camera and table of a rig.
pub struct Equipment {
    // Dropped in this order: the table is stopped before its simulator is switched off.
    /// The camera; `None` while it is gone, and before it is opened.
    pub camera: Option<Box<dyn Camera>>,
    /// The table; `None` while it is gone, before it is opened, and on a rig without a table.
    pub table: Option<Table>,
    simulator: Option<SimulatedTable>,
    settings: Settings,
    clock: Clock,
}

impl Equipment {
    /// Nothing opened yet. Camera and table go by one clock: where neither is real, by
    /// [virtual time](Clock::virtual_time), at most as fast as their addresses say.
    ///
    /// # Errors
    /// [`CaptureError::Refused`] for speeds that do not fit, or a fault that the simulated table cannot make.
    pub fn new(settings: Settings) -> Result<Self, CaptureError> {
        let speed = settings.speed()?;
        Self::at_speed(settings, speed)
    }

    /// The same for a rig that people look at, and that runs while nothing is captured: as fast as
    /// it goes is 20 times real time.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn for_viewers(settings: Settings) -> Result<Self, CaptureError> {
        let speed = match settings.speed()? {
            0.0 => FASTEST_SHOWN,
            speed => speed,
        };
        Self::at_speed(settings, speed)
    }

    fn at_speed(settings: Settings, speed: f64) -> Result<Self, CaptureError> {
        let clock = if settings.is_rehearsal() {
            Clock::at_speed(speed)
        } else {
            Clock::monotonic()
        };
        let simulator = match &settings.turntable {
            TurntableAddress::Simulated(address) => Some(SimulatedTable::new(&SimulatorOptions {
                clock: clock.clone(),
                faults: address.faults.clone(),
                ..SimulatorOptions::default()
            })),
            _ => None,
        };
        Ok(Self {
            camera: None,
            table: None,
            simulator,
            settings,
            clock,
        })
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The clock that everything goes by.
    pub fn clock(&self) -> Clock {
        self.clock.clone()
    }

    /// The simulated table, where the table is one.
    pub fn simulator(&self) -> Option<&SimulatedTable> {
        self.simulator.as_ref()
    }

    /// Whether a table is to be there.
    pub fn wants_table(&self) -> bool {
        self.settings.turntable != TurntableAddress::None
    }

    /// The time of day for the next session's name: waits until no session of the object has it.
    pub(super) fn session_time(&self, object: &str) -> Timestamp {
        loop {
            let now = Timestamp::now();
            if !self.settings.root.join(session_name(now, object)).exists() {
                return now;
            }
            std::thread::sleep(NAME_LOOK);
        }
    }

    /// Opens the camera where it is not.
    ///
    /// # Errors
    /// What opening it answers.
    pub fn open_camera(&mut self) -> Result<&mut dyn Camera, CaptureError> {
        let opened = match self.camera.take() {
            Some(camera) => camera,
            None => {
                let mut camera = camera::open(&self.settings.camera, self.clock.clone())?;
                camera.claim()?;
                camera
            }
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

    fn connect(&self) -> Result<Option<Table>, CaptureError> {
        let options = TableOptions {
            clock: self.clock.clone(),
            ..TableOptions::default()
        };
        if let Some(simulator) = &self.simulator {
            return Ok(Some(Table::open(simulator.open(), &options)?));
        }
        let path = match &self.settings.turntable {
            TurntableAddress::Serial(Some(path)) => path.clone(),
            TurntableAddress::Serial(None) => find_serial()?,
            TurntableAddress::Simulated(_) | TurntableAddress::None => return Ok(None),
        };
        Ok(Some(Table::open_serial(&path, &options)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clock(camera: &str, table: &str) -> Clock {
        let (camera, table) = (camera.parse().unwrap(), table.parse().unwrap());
        let settings = Settings::new("/root".into(), camera, table);
        Equipment::new(settings).unwrap().clock()
    }

    #[test]
    fn a_second_session_of_an_object_waits_until_its_name_is_free() {
        let root = tempfile::tempdir().unwrap();
        let (camera, table) = ("replay:a".parse().unwrap(), "none".parse().unwrap());
        let settings = Settings::new(root.path().to_owned(), camera, table);
        let equipment = Equipment::new(settings).unwrap();
        let name = || session_name(equipment.session_time("mug"), "mug");
        let first = name();
        std::fs::create_dir(root.path().join(&first)).unwrap();
        assert_ne!(name(), first);
    }

    #[test]
    fn a_rehearsal_goes_by_virtual_time_also_at_normal_speed() {
        for (camera, table) in [
            ("replay:a", "sim:"),
            ("replay:a", "none"),
            ("replay:a", "sim:?speed=0"),
        ] {
            assert_ne!(clock(camera, table), Clock::monotonic(), "{camera} {table}");
        }
    }

    #[test]
    fn real_devices_go_by_the_systems_clock() {
        for (camera, table) in [
            ("v4l2:/dev/video0", "sim:"),
            ("replay:a", "serial:/dev/ttyUSB0"),
            ("v4l2:/dev/video0", "none"),
        ] {
            assert_eq!(clock(camera, table), Clock::monotonic(), "{camera} {table}");
        }
    }
}
