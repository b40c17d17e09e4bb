//! The thread of a daemon that has camera and table: does one job after the other, and keeps pictures
//! and state fresh in between.

use std::sync::Arc;
use std::time::Duration;

use relit_data::causes::with_causes;

use super::dispatcher::{Dispatcher, Next};
use super::idle::Idle;
use crate::capture::preflight::ZERO_TAKEN;
use crate::capture::turn::show_table;
use crate::capture::{CaptureContext, CaptureError, Equipment, StopRequest, capture};
use crate::command::Command;
use crate::preview::Preview;
use relit_camera::Camera;
use relit_camera::manual_controls::{ManualPlan, ManualValues};
use relit_turntable::{HomingResult, Table, TurntableError};

/// Time between two checks of a motion.
const PERIOD: Duration = Duration::from_millis(20);

/// The thread that has camera and table.
pub(super) struct Worker {
    // The table is stopped with the equipment, before anything else ends.
    equipment: Equipment,
    dispatcher: Arc<Dispatcher>,
    preview: Preview,
    idle: Idle,
}

impl Worker {
    pub(super) fn new(equipment: Equipment, dispatcher: Arc<Dispatcher>, preview: Preview) -> Self {
        Self {
            idle: Idle::new(&equipment, dispatcher.monitor().clone(), preview.clone()),
            equipment,
            dispatcher,
            preview,
        }
    }

    /// Does jobs until the program is to end.
    pub(super) fn run(&mut self) {
        loop {
            match self.dispatcher.begin() {
                Next::Job(job, stop) => self.work(job, &stop),
                Next::Idle => self.idle.poll(&mut self.equipment),
                Next::End => return,
            }
        }
    }

    fn work(&mut self, job: Command, stop: &StopRequest) {
        match self.do_job(job, stop) {
            Ok(()) => {}
            // Whoever stopped it knows: that is no fault.
            Err(CaptureError::Stopped(who)) => self.note(who.to_string()),
            Err(error) => self.report(with_causes(&error)),
        }
        self.idle.restart();
        self.dispatcher.finish();
    }

    fn do_job(&mut self, job: Command, stop: &StopRequest) -> Result<(), CaptureError> {
        match job {
            Command::Start { object } => self.capture(&object, stop),
            Command::Stop if !self.equipment.wants_table() => Ok(()),
            Command::Stop => self.with_table(stop, Table::stop).map(drop),
            Command::Home => self.with_table(stop, Table::home).map(drop),
            Command::Jog { degrees } => {
                let jog = |table: &Table| table.jog(degrees, None);
                self.with_table(stop, jog).map(drop)
            }
            Command::Reset => {
                if self.with_table(stop, Table::reset)? == HomingResult::WhereItStands {
                    self.report(ZERO_TAKEN.to_owned());
                }
                Ok(())
            }
            Command::SetControl { name, value } => self.set_control(&name, value),
        }
    }

    fn capture(&mut self, object: &str, stop: &StopRequest) -> Result<(), CaptureError> {
        let monitor = self.dispatcher.monitor();
        let context = CaptureContext {
            monitor,
            preview: Some(&self.preview),
            stop,
        };
        let captured = capture(&mut self.equipment, object, context);
        monitor.update(|state| state.session = None);
        if captured.is_err() {
            // Its session may not have been closed.
            self.idle.recover();
        }
        let summary = captured?.take;
        if let Some(reason) = summary.reason {
            let what = format!("{}: {reason}", summary.session);
            if summary.is_stopped {
                self.note(what);
            } else {
                self.report(what);
            }
        }
        Ok(())
    }

    fn note(&self, what: String) {
        self.dispatcher.monitor().update(|state| state.note(what));
    }

    fn report(&self, fault: String) {
        let now_us = self.equipment.clock().now_us();
        self.dispatcher.monitor().fault(now_us, fault);
    }

    /// Lets the table do something, while pictures and its angle go on being shown.
    fn with_table<T: Send>(
        &mut self,
        stop: &StopRequest,
        motion: impl FnOnce(&Table) -> Result<T, TurntableError> + Send,
    ) -> Result<T, CaptureError> {
        let Some(table) = self.equipment.table.as_ref() else {
            let none = "no turntable is connected: plug it in, or look at its fault";
            return Err(CaptureError::Missing(none.to_owned()));
        };
        let clock = self.equipment.clock();
        let (camera, idle) = (&mut self.equipment.camera, &mut self.idle);
        let monitor = self.dispatcher.monitor();
        let moved = stop.over(table, || {
            clock.scope(|scope| {
                let moving = scope.spawn("relit-motion", || motion(table));
                let moving = moving.map_err(CaptureError::system("a thread", "started"))?;
                while !moving.is_finished() {
                    // What is wrong with either shows when the motion is over.
                    let _ = show_table(monitor, table);
                    if let Some(camera) = camera.as_mut() {
                        let _ = idle.take_frame(camera.as_mut());
                    }
                    clock.sleep(PERIOD);
                }
                // A motion that panicked was stopped by what it left behind, and nobody saw it.
                let moved = moving.join();
                Ok::<_, CaptureError>(moved.unwrap_or(Err(TurntableError::NotStopped))?)
            })
        });
        stop.explain(moved)
    }

    fn set_control(&mut self, name: &str, value: i64) -> Result<(), CaptureError> {
        let camera = self.equipment.camera.as_mut();
        let camera = camera.ok_or_else(CaptureError::no_camera)?.as_mut();
        let set = match set_by_name(camera, name, value) {
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
    let control = found.ok_or_else(|| {
        CaptureError::Missing(format!(
            "the camera has no control {name:?}: `relit-capture devices` lists those that it has"
        ))
    })?;
    camera.set_control(control.id, value)?;
    Ok(())
}
