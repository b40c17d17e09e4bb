//! Metering turns of a simulated table, seen by a camera whose light is known.

use std::time::Duration;

use relit_data::causes::with_causes;
use relit_data::session::FrameClock;

use super::*;
use crate::camera::{
    ControlFlags, ControlId, ControlKind, DeviceInfo, Fourcc, GrantedMode, MenuItem, Mode,
    ModeRequest, Rate, Rates, Sizes,
};
use crate::capture::Settings;
use crate::capture::preflight::ready_table;
use crate::clock::Clock;
use crate::simulator::{SimulatedTable, SimulatorOptions};
use crate::turntable::TableOptions;

const EXPOSURE: ControlId = ControlId(1);
const AUTOMATIC: ControlId = ControlId(2);
/// Frames of the camera are so long apart, microseconds.
const PERIOD_US: i64 = 33_333;

/// A camera that sees nothing but how bright the light is at the table's angle.
struct Scene<'a> {
    clock: Clock,
    table: &'a SimulatedTable,
    /// The grey value at exposure 1.
    light: fn(f64) -> f64,
    exposure: i64,
    automatic: i64,
    frames: u64,
    due_us: i64,
    info: DeviceInfo,
}

impl<'a> Scene<'a> {
    fn new(clock: Clock, table: &'a SimulatedTable, light: fn(f64) -> f64) -> Self {
        let info = DeviceInfo {
            address: "v4l2:/dev/scene".parse().unwrap(),
            name: "scene".to_owned(),
            driver: String::new(),
            bus: String::new(),
            modes: Vec::new(),
            problems: Vec::new(),
        };
        Self {
            due_us: clock.now_us(),
            clock,
            table,
            light,
            exposure: 40,
            automatic: 3,
            frames: 0,
            info,
        }
    }
}

impl Camera for Scene<'_> {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn modes(&mut self) -> Result<Vec<Mode>, crate::camera::CameraError> {
        Ok(vec![Mode {
            fourcc: Fourcc::GREY,
            sizes: Sizes::One(8, 8),
            rates: Rates::List(Rate::new(30, 1).into_iter().collect()),
        }])
    }

    fn controls(&mut self) -> Result<Vec<Control>, crate::camera::CameraError> {
        let control = |id, name: &str, kind, minimum, maximum, value| Control {
            id,
            name: name.to_owned(),
            kind,
            minimum,
            maximum,
            step: 1,
            default: minimum,
            value: Some(value),
            flags: ControlFlags::default(),
        };
        let item = |index, label: &str| MenuItem {
            index,
            label: label.to_owned(),
        };
        let modes = vec![item(1, "Manual Mode"), item(3, "Aperture Priority Mode")];
        Ok(vec![
            control(
                EXPOSURE,
                TIMED[0],
                ControlKind::Integer,
                3,
                2047,
                self.exposure,
            ),
            control(
                AUTOMATIC,
                "auto_exposure",
                ControlKind::Menu(modes),
                0,
                3,
                self.automatic,
            ),
        ])
    }

    fn set_control(
        &mut self,
        id: ControlId,
        value: i64,
    ) -> Result<i64, crate::camera::CameraError> {
        match id {
            EXPOSURE => self.exposure = value,
            _ => self.automatic = value,
        }
        Ok(value)
    }

    fn start(&mut self, want: &ModeRequest) -> Result<GrantedMode, crate::camera::CameraError> {
        Ok(GrantedMode {
            fourcc: want.fourcc,
            width: want.width,
            height: want.height,
            rate: Some(want.rate),
        })
    }

    fn next_frame(&mut self, _: Duration) -> Result<Frame, crate::camera::CameraError> {
        // A camera does not wait for a reader that is late.
        let late = (self.clock.now_us() - self.due_us) / PERIOD_US;
        self.due_us += PERIOD_US * late.max(1);
        let wait = u64::try_from(self.due_us - self.clock.now_us()).unwrap_or(0);
        self.clock.sleep(Duration::from_micros(wait));
        self.frames += 1;
        let angle_deg = self.table.angle_at(self.due_us).rem_euclid(360.0);
        let grey = ((self.light)(angle_deg) * self.exposure as f64).min(255.0) as u8;
        Ok(Frame {
            fourcc: Fourcc::GREY,
            width: 8,
            height: 8,
            data: vec![grey; 64],
            sequence: Some(self.frames),
            t_us: self.due_us,
            clock: FrameClock::Driver,
            flagged: false,
        })
    }

    fn stop(&mut self) -> Result<(), crate::camera::CameraError> {
        Ok(())
    }
}

/// Meters a light; gives the exposure found, and how far the table stands from where it was.
fn metered(light: fn(f64) -> f64) -> (Result<i64, CaptureError>, f64, i64) {
    let clock = Clock::virtual_time();
    let _participant = clock.take_part();
    let simulator = SimulatedTable::new(&SimulatorOptions {
        clock: clock.clone(),
        ..SimulatorOptions::default()
    });
    let locks = tempfile::tempdir().unwrap();
    let options = TableOptions {
        clock: clock.clone(),
        runtime_folder: locks.path().to_owned(),
        ..TableOptions::default()
    };
    let table = Table::open(simulator.open(), &options).unwrap();
    let mut settings = Settings::new(
        locks.path().to_owned(),
        "replay:a".parse().unwrap(),
        "sim:".parse().unwrap(),
    );
    settings.wanted.exposure = Some(40);
    let stop = StopRequest::new(&clock);
    let mut scene = Scene::new(clock, &simulator, light);
    let mut locked = LockedCamera::lock(&mut scene, &settings, &stop).unwrap();
    ready_table(&table, &settings).unwrap();
    let before = table.status().unwrap().angle_deg;
    let found = meter(&mut scene, &table, &mut locked, &stop);
    let off = table.status().unwrap().angle_deg - before;
    (found, off, scene.exposure)
}

#[test]
fn the_exposure_holds_at_the_brightest_part_of_the_turn_and_the_table_is_back() {
    // A highlight of ten degrees: it saturates from an exposure of 100 on.
    let light = |angle: f64| {
        if (200.0..210.0).contains(&angle) {
            2.5
        } else {
            0.5
        }
    };
    let (found, off, set) = metered(light);
    let found = found.unwrap();
    assert!((50..100).contains(&found), "{found}");
    assert_eq!(set, found);
    assert!(off.abs() < 0.1, "{off}");
}

#[test]
fn a_dark_scene_gets_the_brightest_exposure_that_a_frame_has_time_for() {
    let (found, ..) = metered(|_| 0.1);
    assert_eq!(found.unwrap(), 333);
}

#[test]
fn a_scene_that_is_too_bright_at_the_darkest_exposure_is_reported() {
    let (found, ..) = metered(|_| 200.0);
    let error = with_causes(&found.unwrap_err());
    let words = "saturate at the darkest exposure (3)";
    assert!(error.contains(words), "{error}");
}
