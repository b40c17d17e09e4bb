//! The thread of a daemon that owns camera and table: does one job after the other, and looks
//! after both in between.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::Duration;

use super::idle::Idle;
use super::viewer::Viewer;
use crate::camera::Camera;
use crate::camera::hold::{ManualPlan, ManualValues};
use crate::capture::CaptureError;
use crate::capture::Equipment;
use crate::capture::turn::show_table;
use crate::capture::{CaptureContext, CaptureRequest, capture};
use crate::capture::{StopRequest, Stopped};
use crate::state::{Monitor, Phase, RigState};
use crate::turntable::{Table, TurntableError};

/// How often a motion is looked at.
const LOOK: Duration = Duration::from_millis(20);

/// What the owner does.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Job {
    Capture(CaptureRequest),
    StopTable,
    Home,
    Jog(f64),
    Unlock,
    SetControl(String, i64),
}

/// The phase of a rig on which nothing is under way.
pub(super) fn rest(state: &mut RigState, busy: &AtomicBool) {
    if busy.load(Ordering::Acquire) {
        return;
    }
    state.phase = match state.queue.is_empty() {
        true => Phase::Idle,
        false => Phase::WaitingForObject,
    };
}

/// The thread that owns camera and table.
pub(super) struct Owner {
    // The table is stopped with the equipment, before anything else ends.
    equipment: Equipment,
    monitor: Monitor,
    viewer: Viewer,
    idle: Idle,
    busy: Arc<AtomicBool>,
    stop: StopRequest,
}

impl Owner {
    pub(super) fn new(
        equipment: Equipment,
        monitor: Monitor,
        viewer: Viewer,
        busy: Arc<AtomicBool>,
        stop: StopRequest,
    ) -> Self {
        Self {
            idle: Idle::new(monitor.clone()),
            equipment,
            monitor,
            viewer,
            busy,
            stop,
        }
    }

    /// Does jobs, and keeps the rig's state true between them, until the program is to end.
    pub(super) fn run(&mut self, jobs: &Receiver<Job>) {
        while self.stop.asked() != Some(Stopped::Shutdown) {
            match jobs.try_recv() {
                Ok(job) => self.work(job),
                Err(TryRecvError::Empty) => self.idle.glance(&mut self.equipment, &self.viewer),
                Err(TryRecvError::Disconnected) => return,
            }
        }
    }

    fn work(&mut self, job: Job) {
        if let Err(error) = self.do_job(job) {
            let now_us = self.equipment.clock().now_us();
            self.monitor.fault(now_us, error.to_string());
        }
        self.stop.forget();
        self.idle.begin_again();
        self.busy.store(false, Ordering::Release);
        self.monitor.update(|state| rest(state, &self.busy));
    }

    fn do_job(&mut self, job: Job) -> Result<(), CaptureError> {
        match job {
            Job::Capture(request) => self.capture(&request),
            Job::StopTable => self.with_table(|table| table.stop().map(|_| ())),
            Job::Home => self.with_table(|table| table.home().map(|_| ())),
            Job::Jog(degrees) => self.with_table(|table| table.jog(degrees, None).map(|_| ())),
            Job::Unlock => self.with_table(|table| table.unlock().map(|_| ())),
            Job::SetControl(name, value) => self.set_control(&name, value),
        }
    }

    fn capture(&mut self, request: &CaptureRequest) -> Result<(), CaptureError> {
        let context = CaptureContext {
            monitor: &self.monitor,
            viewer: Some(&self.viewer),
            stop: &self.stop,
        };
        let captured = capture(&mut self.equipment, request, context);
        self.monitor.update(|state| state.session = None);
        let summary = captured?.take;
        if let Some(reason) = summary.reason {
            let now_us = self.equipment.clock().now_us();
            self.monitor
                .fault(now_us, format!("{}: {reason}", summary.session));
        }
        Ok(())
    }

    /// Lets the table do something, while pictures and its angle go on being shown.
    fn with_table(
        &mut self,
        motion: impl FnOnce(&Table) -> Result<(), TurntableError> + Send,
    ) -> Result<(), CaptureError> {
        let Some(table) = self.equipment.table.as_ref() else {
            return Err(CaptureError::NoTable);
        };
        let (camera, viewer, idle) = (&mut self.equipment.camera, &self.viewer, &mut self.idle);
        let moved = self.stop.over(table, || {
            std::thread::scope(|scope| {
                let moving = scope.spawn(|| motion(table));
                while !moving.is_finished() {
                    // What is wrong with either is seen and told when the motion is over.
                    let _ = show_table(&self.monitor, table);
                    if let Some(camera) = camera.as_mut() {
                        let _ = idle.take_frame(camera.as_mut(), viewer);
                    }
                    std::thread::sleep(LOOK);
                }
                moving.join()
            })
        });
        // A motion that broke down was stopped by what it left behind, and nobody saw it.
        Ok(moved.unwrap_or(Err(TurntableError::NotStopped))?)
    }

    fn set_control(&mut self, name: &str, value: i64) -> Result<(), CaptureError> {
        let camera = self
            .equipment
            .camera
            .as_mut()
            .ok_or(CaptureError::NoCamera)?;
        let camera = camera.as_mut();
        let set = set_by_name(camera, name, value);
        let set = match set {
            // An automatic may rule it: that is switched off, as it is for every capture.
            Err(CaptureError::Camera(_)) => {
                let controls = camera.controls()?;
                ManualPlan::new(&controls, &ManualValues::default()).apply(camera)?;
                set_by_name(camera, name, value)
            }
            set => set,
        };
        self.idle.show_controls(camera);
        set
    }
}

fn set_by_name(camera: &mut dyn Camera, name: &str, value: i64) -> Result<(), CaptureError> {
    let controls = camera.controls()?;
    let found = controls.iter().find(|control| control.name == name);
    let control = found.ok_or_else(|| CaptureError::NoControl(name.to_owned()))?;
    camera.set_control(control.id, value)?;
    Ok(())
}
