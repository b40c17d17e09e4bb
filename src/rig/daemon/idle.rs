//! The time between captures: pictures for the person who sets up the object, the table's state,
//! and cameras and tables that come back after they were unplugged.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::viewer::Viewer;
use crate::camera::hold::ManualPlan;
use crate::camera::{Camera, CameraError, GrantedMode};
use crate::capture::CaptureError;
use crate::capture::Equipment;
use crate::capture::preflight::free_bytes;
use crate::capture::turn::show_table;
use crate::clock::Clock;
use crate::state::{CameraState, Monitor, TableState};

/// Longest wait for a frame in one go.
const GLANCE: Duration = Duration::from_millis(50);
/// Without a frame for so long the camera is opened anew.
const SILENT: Duration = Duration::from_secs(2);
/// How often the table is asked.
const ASKING: Duration = Duration::from_millis(250);
/// How often something that is gone is looked for, and free space is looked at.
const LOOKING: Duration = Duration::from_secs(1);

/// Keeps a rig's state true while nothing is captured.
pub(super) struct Idle {
    monitor: Monitor,
    streams: Option<GrantedMode>,
    last_frame: Instant,
    counted: (Instant, u32),
    asked: Option<Instant>,
    looked: Option<Instant>,
}

impl Idle {
    pub(super) fn new(monitor: Monitor) -> Self {
        let now = Instant::now();
        Self {
            monitor,
            streams: None,
            last_frame: now,
            counted: (now, 0),
            asked: None,
            looked: None,
        }
    }

    /// After something else had camera and table: looks at all of it anew.
    pub(super) fn begin_again(&mut self) {
        let now = Instant::now();
        (self.last_frame, self.counted) = (now, (now, 0));
        (self.asked, self.looked) = (None, None);
    }

    /// One glance: takes a frame if one comes soon, asks the table if it is time.
    pub(super) fn glance(&mut self, equipment: &mut Equipment, viewer: &Viewer) {
        if due(&mut self.looked, LOOKING) {
            self.look_for_what_is_gone(equipment);
            if let Ok(free) = free_bytes(&equipment.settings().root) {
                self.monitor.update(|state| state.free_bytes = free);
            }
        }
        if due(&mut self.asked, ASKING) {
            self.ask_table(equipment);
        }
        let Some(camera) = equipment.camera.as_mut().filter(|_| self.streams.is_some()) else {
            std::thread::sleep(GLANCE);
            return;
        };
        if let Err(error) = self.take_frame(camera.as_mut(), viewer) {
            self.lost_camera(equipment, &error);
        }
    }

    /// Takes the next frame for the viewers.
    pub(super) fn take_frame(
        &mut self,
        camera: &mut dyn Camera,
        viewer: &Viewer,
    ) -> Result<(), CameraError> {
        match camera.next_frame(GLANCE) {
            Ok(frame) => {
                viewer.offer(&Arc::new(frame));
                self.last_frame = Instant::now();
                self.count();
                Ok(())
            }
            Err(CameraError::Timeout { .. }) if self.last_frame.elapsed() < SILENT => Ok(()),
            Err(error) => Err(error),
        }
    }

    fn count(&mut self) {
        let (since, frames) = &mut self.counted;
        *frames += 1;
        let elapsed = since.elapsed();
        if elapsed >= LOOKING {
            let fps = f64::from(*frames) / elapsed.as_secs_f64();
            self.counted = (Instant::now(), 0);
            self.monitor.update(|state| state.camera.fps = Some(fps));
        }
    }

    fn look_for_what_is_gone(&mut self, equipment: &mut Equipment) {
        if equipment.camera.is_none() {
            self.streams = None;
        }
        if self.streams.is_none() {
            match self.start_camera(equipment) {
                Ok(mode) => {
                    self.streams = Some(mode);
                    self.last_frame = Instant::now();
                }
                Err(error) => self.no_camera(&error.to_string()),
            }
        }
        if equipment.wants_table()
            && equipment.table.is_none()
            && let Err(error) = equipment.open_table()
        {
            self.no_table(&error.to_string());
        }
    }

    fn start_camera(&self, equipment: &mut Equipment) -> Result<GrantedMode, CaptureError> {
        let wish = equipment.settings().mode;
        let camera = equipment.open_camera()?;
        let request = wish.choose(&camera.modes()?)?;
        let mode = camera.start(&request)?;
        let name = camera.info().name.clone();
        let controls = held_controls(camera);
        self.monitor.update(|state| {
            state.camera = CameraState {
                present: true,
                name,
                mode: mode.to_string(),
                controls,
                ..CameraState::default()
            };
        });
        Ok(mode)
    }

    /// Shows the settings as the camera has them now.
    pub(super) fn show_controls(&self, camera: &mut dyn Camera) {
        let controls = held_controls(camera);
        self.monitor
            .update(|state| state.camera.controls = controls);
    }

    /// The camera is gone, and will be looked for.
    pub(super) fn lost_camera(&mut self, equipment: &mut Equipment, error: &CameraError) {
        self.streams = None;
        // A replay that is over begins again with the next start.
        if matches!(error, CameraError::EndOfRecording { .. }) {
            return;
        }
        equipment.drop_camera();
        self.no_camera(&error.to_string());
    }

    fn no_camera(&self, why: &str) {
        let told = self.monitor.state().camera.fault;
        self.monitor.update(|state| {
            state.camera.present = false;
            state.camera.fps = None;
            state.camera.fault = Some(why.to_owned());
        });
        if told.as_deref() != Some(why) {
            self.monitor.fault(Clock::monotonic().now_us(), why);
        }
    }

    fn no_table(&self, why: &str) {
        let told = self.monitor.state().table.fault;
        self.monitor.update(|state| {
            state.table = TableState {
                fault: Some(why.to_owned()),
                ..TableState::default()
            };
        });
        if told.as_deref() != Some(why) {
            self.monitor.fault(Clock::monotonic().now_us(), why);
        }
    }

    fn ask_table(&self, equipment: &mut Equipment) {
        let Some(table) = equipment.table.as_ref() else {
            return;
        };
        if let Err(error) = show_table(&self.monitor, table) {
            // Opening it again tells whether it has come back.
            equipment.drop_table();
            self.no_table(&error.to_string());
        }
    }
}

/// The settings that are held during a capture, as they are now.
fn held_controls(camera: &mut dyn Camera) -> Vec<(String, i64)> {
    let Ok(controls) = camera.controls() else {
        return Vec::new();
    };
    let plan = ManualPlan::new(&controls, &crate::camera::hold::ManualValues::default());
    let value = |name: &str| controls.iter().find(|control| control.name == name)?.value;
    let held = plan.steps.iter();
    held.filter_map(|step| Some((step.name.clone(), value(&step.name)?)))
        .collect()
}

/// Whether it is time again; notes that it was.
fn due(last: &mut Option<Instant>, every: Duration) -> bool {
    let due = last.is_none_or(|last| last.elapsed() >= every);
    if due {
        *last = Some(Instant::now());
    }
    due
}
