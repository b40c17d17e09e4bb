//! The time between captures: pictures for the person who sets up the object, the table's state,
//! and cameras and tables that come back after they were unplugged.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use relit_data::causes::with_causes;

use super::report_recovered;
use crate::capture::preflight::free_bytes;
use crate::capture::turn::show_table;
use crate::capture::{CaptureError, Equipment};
use crate::preview::Preview;
use crate::state::{CameraState, Monitor, RigState, TableState};
use relit_camera::manual_controls::{ManualPlan, ManualValues};
use relit_camera::{Camera, CameraError};
use relit_data::clock::Clock;

/// Longest wait for a frame in one go: how late a command is noticed.
const FRAME_WAIT: Duration = Duration::from_millis(50);
/// After this long without a frame the camera is opened again.
const SILENCE: Duration = Duration::from_secs(2);
/// Time between two requests for the table's status.
const TABLE_PERIOD: Duration = Duration::from_millis(250);
/// Time between two searches for missing devices, and two checks of the free space.
const SEARCH_PERIOD: Duration = Duration::from_secs(1);
/// Time over which the frame rate is measured.
const RATE_PERIOD: Duration = Duration::from_secs(1);

/// Keeps a rig's state and picture fresh while nothing is captured.
pub(super) struct Idle {
    monitor: Monitor,
    preview: Preview,
    clock: Clock,
    /// Whether the camera was started.
    streams: bool,
    last_frame_us: i64,
    /// The time stamp since which frames are counted, and how many came.
    counted: Option<(i64, u32)>,
    table_due_us: i64,
    search_due_us: i64,
    /// Whether there may be interrupted sessions.
    is_to_recover: bool,
}

impl Idle {
    pub(super) fn new(equipment: &Equipment, monitor: Monitor, preview: Preview) -> Self {
        let clock = equipment.clock();
        let now_us = clock.now_us();
        Self {
            monitor,
            preview,
            clock,
            streams: false,
            last_frame_us: now_us,
            counted: None,
            table_due_us: now_us,
            search_due_us: now_us,
            is_to_recover: false,
        }
    }

    /// Checks everything again, after something else used camera and table.
    pub(super) fn restart(&mut self) {
        let now_us = self.clock.now_us();
        (self.last_frame_us, self.counted) = (now_us, None);
        (self.table_due_us, self.search_due_us) = (now_us, now_us);
    }

    /// Closes interrupted sessions as soon as their folder can be read.
    pub(super) fn recover(&mut self) {
        self.is_to_recover = true;
    }

    /// Waits a moment for a frame, and does what is due.
    pub(super) fn poll(&mut self, equipment: &mut Equipment) {
        let now_us = self.clock.now_us();
        if now_us >= self.search_due_us {
            self.search_due_us = self.clock.after(SEARCH_PERIOD);
            self.search(equipment);
            self.look_at_folder(&equipment.settings().root);
        }
        if now_us >= self.table_due_us {
            self.table_due_us = self.clock.after(TABLE_PERIOD);
            self.check_table(equipment);
        }
        let Some(camera) = equipment.camera.as_mut().filter(|_| self.streams) else {
            self.clock.sleep(FRAME_WAIT);
            return;
        };
        if let Err(error) = self.take_frame(camera.as_mut()) {
            self.lose_camera(equipment, &error);
        }
    }

    /// Takes the next frame for the preview.
    pub(super) fn take_frame(&mut self, camera: &mut dyn Camera) -> Result<(), CameraError> {
        let frame = camera.next_frame(FRAME_WAIT);
        let now_us = self.clock.now_us();
        match frame {
            Ok(frame) => {
                self.count(frame.t_us);
                self.preview.publish(&Arc::new(frame));
                self.last_frame_us = now_us;
                Ok(())
            }
            Err(CameraError::Timeout { .. }) if since(self.last_frame_us, now_us) < SILENCE => {
                Ok(())
            }
            Err(error) => Err(error),
        }
    }

    /// Measures the rate by the frames' own time stamps: those that waited come faster.
    fn count(&mut self, t_us: i64) {
        let Some((begun_us, frames)) = &mut self.counted else {
            self.counted = Some((t_us, 0));
            return;
        };
        *frames += 1;
        let passed = since(*begun_us, t_us);
        if passed >= RATE_PERIOD {
            let fps = f64::from(*frames) / passed.as_secs_f64();
            self.counted = Some((t_us, 0));
            self.monitor.update(|state| state.camera.fps = Some(fps));
        }
    }

    /// Opens what is not open.
    fn search(&mut self, equipment: &mut Equipment) {
        self.streams &= equipment.camera.is_some();
        if !self.streams {
            match self.start_camera(equipment) {
                Ok(()) => {
                    self.streams = true;
                    self.last_frame_us = self.clock.now_us();
                }
                Err(error) => self.show_no_camera(with_causes(&error)),
            }
        }
        if equipment.wants_table()
            && equipment.table.is_none()
            && let Err(error) = equipment.open_table()
        {
            self.show_no_table(with_causes(&error));
        }
    }

    /// Shows the free space of the folder of sessions, or that the folder is gone.
    fn look_at_folder(&mut self, root: &Path) {
        let fault = match free_bytes(root) {
            Ok(free) => {
                self.monitor.update(|state| {
                    state.free_bytes = free;
                    state.disk_fault = None;
                });
                if self.is_to_recover {
                    // What cannot be listed is tried again.
                    self.is_to_recover =
                        report_recovered(root, &self.clock, &self.monitor).is_err();
                }
                return;
            }
            Err(error) => with_causes(&error),
        };
        let why =
            format!("no session can be written: {fault}; put the folder back, or mount its disk");
        self.show_fault(why, |state, why| {
            state.free_bytes = 0;
            state.disk_fault.replace(why)
        });
    }

    fn start_camera(&self, equipment: &mut Equipment) -> Result<(), CaptureError> {
        let preference = equipment.settings().mode;
        let camera = equipment.open_camera()?;
        let request = preference.choose(&camera.modes()?)?;
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
        Ok(())
    }

    /// Shows the settings as the camera has them now.
    pub(super) fn show_controls(&self, camera: &mut dyn Camera) {
        let controls = held_controls(camera);
        self.monitor
            .update(|state| state.camera.controls = controls);
    }

    /// Closes a camera that failed; it is searched for from now on.
    fn lose_camera(&mut self, equipment: &mut Equipment, error: &CameraError) {
        self.streams = false;
        // A replay that is over begins again with the next start.
        if matches!(error, CameraError::EndOfRecording { .. }) {
            return;
        }
        equipment.camera = None;
        self.show_no_camera(with_causes(error));
    }

    fn check_table(&self, equipment: &mut Equipment) {
        let Some(table) = equipment.table.as_ref() else {
            return;
        };
        if let Err(error) = show_table(&self.monitor, table) {
            // Opening it again shows whether it has come back.
            equipment.table = None;
            self.show_no_table(with_causes(&error));
        }
    }

    fn show_no_camera(&self, why: String) {
        self.show_fault(why, |state, why| {
            state.camera.present = false;
            state.camera.fps = None;
            state.camera.fault.replace(why)
        });
    }

    fn show_no_table(&self, why: String) {
        self.show_fault(why, |state, why| {
            let before = state.table.fault.take();
            state.table = TableState {
                fault: Some(why),
                ..TableState::default()
            };
            before
        });
    }

    /// Shows a fault by `change`, which gives the one before; a new one is listed too.
    fn show_fault(
        &self,
        why: String,
        change: impl FnOnce(&mut RigState, String) -> Option<String>,
    ) {
        let mut before = None;
        self.monitor
            .update(|state| before = change(state, why.clone()));
        if before.as_ref() != Some(&why) {
            self.monitor.fault(self.clock.now_us(), why);
        }
    }
}

fn since(earlier_us: i64, now_us: i64) -> Duration {
    Duration::from_micros(now_us.abs_diff(earlier_us))
}

/// The settings that are held during a capture, as they are now.
fn held_controls(camera: &mut dyn Camera) -> Vec<(String, i64)> {
    let Ok(controls) = camera.controls() else {
        return Vec::new();
    };
    let plan = ManualPlan::new(&controls, &ManualValues::default());
    let value = |name: &str| controls.iter().find(|control| control.name == name)?.value;
    let held = plan.steps.iter();
    held.filter_map(|step| Some((step.name.clone(), value(&step.name)?)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::Settings;

    #[test]
    fn the_frame_rate_is_the_cameras_also_where_frames_have_waited() {
        let (camera, table) = ("replay:a".parse().unwrap(), "none".parse().unwrap());
        let settings = Settings::new("/root".into(), camera, table);
        let monitor = Monitor::default();
        let preview = Preview::start(monitor.clone()).unwrap();
        let equipment = Equipment::new(settings).unwrap();
        let mut idle = Idle::new(&equipment, monitor.clone(), preview);
        // After a take they come all at once.
        (0..40).for_each(|n| idle.count(33_333 * n));
        let fps = monitor.state().camera.fps.unwrap();
        assert!((fps - 30.0).abs() < 0.1, "{fps}");
    }
}
