//! The metering turn: the table turns slowly, and an [`ExposureSearch`] finds the exposure.

mod search;
#[cfg(test)]
mod tests;

use super::error::{CaptureError, MeterFault, Refusal};
use super::locked_camera::{LockedCamera, NEXT_FRAME};
use super::stop::StopRequest;
use crate::camera::hold::{Aspect, ControlSetting};
use crate::camera::{Camera, Control, Frame};
use crate::turntable::{Table, Turn, TurnPlan, TurnRequest};
use relit_data::geometry::Rect;
use relit_data::image_stats::{SATURATION_LEVEL, measure_whole};
use relit_video::LiveDecoder;
use search::{Advice, ExposureRange, ExposureSearch};

/// The part of the pixels in the middle that may saturate.
const MAX_CLIPPED: f64 = 0.005;
/// Most degrees that the table turns from one frame to the next: two frames of each degree.
const DEGREES_A_FRAME: f64 = 0.48;
/// Most degrees of the metering turn: two turns.
const MOST_TURN: f64 = 720.0;
/// Degrees at constant speed on either side of it.
const MARGIN_DEG: f64 = 1.0;
/// Frames until a new exposure has effect in every one of them.
const LATE_FRAMES: usize = 6;
/// Units of `exposure_time_absolute` in a second.
const EXPOSURE_UNITS: f64 = 10_000.0;
/// Names of controls whose unit that is.
const TIMED: [&str; 2] = ["exposure_time_absolute", "exposure_absolute"];

/// Turns the table slowly, finds the exposure, and leaves the camera set to it; the table is back
/// where it stood. The camera streams before and after.
///
/// # Errors
/// [`MeterFault`], a stop that was asked for, or what camera and table answer; the table has been
/// stopped.
pub(super) fn meter(
    camera: &mut dyn Camera,
    table: &Table,
    locked: &mut LockedCamera,
    stop: &StopRequest,
) -> Result<i64, CaptureError> {
    let steps = &locked.plan.steps;
    let at = steps.iter().position(is_exposure);
    let at = at.ok_or(MeterFault::NoExposure)?;
    let step = steps[at].clone();
    let stream = locked.stream;
    let (fps, decoder) = (
        stream.fps,
        LiveDecoder::new(stream.format, stream.width, stream.height),
    );
    let range = exposure_range(&locked.controls, &step, fps).ok_or(MeterFault::NoExposure)?;
    let mut metering = MeteringLoop {
        camera: &mut *camera,
        stop,
        search: ExposureSearch::new(range, MAX_CLIPPED),
        step,
        decoder: decoder.map_err(MeterFault::NoPicture)?,
        late: LATE_FRAMES,
    };
    metering.set_exposure()?;
    let found = stop.explain(stop.over(table, || metering.turn(table, fps)))?;
    locked.relock(camera, at, found)?;
    Ok(found)
}

fn is_exposure(step: &ControlSetting) -> bool {
    let name = step.name.as_str();
    step.aspect == Aspect::Exposure && (TIMED.contains(&name) || name == "exposure")
}

/// The exposures of a control that fit into a frame's time, where its unit is known; else all.
fn exposure_range(controls: &[Control], step: &ControlSetting, fps: f64) -> Option<ExposureRange> {
    let control = controls.iter().find(|control| control.id == step.id)?;
    let spacing = i64::try_from(control.step.max(1)).ok()?;
    let darkest = control.minimum.max(1);
    let longest = match TIMED.contains(&step.name.as_str()) {
        true => control.maximum.min((EXPOSURE_UNITS / fps) as i64),
        false => control.maximum,
    };
    let steps = longest.checked_sub(darkest)?.max(0) / spacing;
    Some(ExposureRange {
        darkest,
        brightest: darkest.checked_add(steps.checked_mul(spacing)?)?,
        step: spacing,
    })
}

/// Frames in, exposures out.
struct MeteringLoop<'a> {
    camera: &'a mut dyn Camera,
    stop: &'a StopRequest,
    search: ExposureSearch,
    /// The control of the exposure.
    step: ControlSetting,
    decoder: LiveDecoder,
    /// Frames until the present exposure has effect.
    late: usize,
}

impl MeteringLoop<'_> {
    /// Sets the exposure that the search wants.
    fn set_exposure(&mut self) -> Result<(), CaptureError> {
        let set = self.search.exposure();
        let read = self.camera.set_control(self.step.id, set)?;
        if read != set {
            return Err(Refusal::Other(format!(
                "the exposure was set to {set} and reads {read}: leave --meter out"
            ))
            .into());
        }
        self.late = LATE_FRAMES;
        Ok(())
    }

    /// Turns the table until the exposure is found, and back.
    fn turn(&mut self, table: &Table, fps: f64) -> Result<i64, CaptureError> {
        let home_deg = table.status()?.angle_deg;
        let plan = plan(table, fps, home_deg)?;
        let mut turn = table.start_turn(plan)?;
        let found = self.search_in(&mut turn);
        let stopped = turn.abort();
        let found = found?;
        table.jog(home_deg - stopped?.angle_deg, None)?;
        Ok(found)
    }

    fn search_in(&mut self, turn: &mut Turn<'_>) -> Result<i64, CaptureError> {
        let (from_us, to_us) = turn.wait_constant()?;
        let speed = turn.plan().degrees_per_second;
        loop {
            self.stop.check()?;
            turn.check()?;
            let frame = self.camera.next_frame(NEXT_FRAME)?;
            if frame.t_us >= to_us {
                return Err(MeterFault::Unseen(self.search.unseen()).into());
            }
            let Some(clipped) = self.clipped(&frame) else {
                continue;
            };
            if frame.t_us < from_us {
                continue;
            }
            let turned_deg = (frame.t_us - from_us) as f64 / 1e6 * speed;
            match self.search.add(turned_deg, clipped)? {
                Advice::Continue => {}
                Advice::Set => self.set_exposure()?,
                Advice::Done => return Ok(self.search.exposure()),
            }
        }
    }

    /// The part of the middle that saturates; `None` of a frame that is damaged or was exposed
    /// before the present exposure had effect.
    fn clipped(&mut self, frame: &Frame) -> Option<f64> {
        // Frames that build on others have to be decoded all.
        let picture = self.decoder.decode(&frame.data).ok()??;
        if self.late > 0 {
            self.late -= 1;
            return None;
        }
        let (width, height) = picture.size();
        let rgb = picture.rgb(Rect::middle_of(width, height)).ok()?;
        Some(measure_whole(&rgb, SATURATION_LEVEL).saturated_fraction())
    }
}

/// Two turns, or as much of them as the cable allows, but one at least; begun as close to where the
/// table stands as the limits allow.
fn plan(table: &Table, fps: f64, home_deg: f64) -> Result<TurnPlan, CaptureError> {
    let identity = table.identity();
    let speed = (DEGREES_A_FRAME * fps).min(identity.max_degrees_per_second);
    let ramp_deg = speed * speed / (2.0 * identity.acceleration) + MARGIN_DEG + 1.0;
    let (low_deg, high_deg) = identity.limits;
    let free_deg = high_deg - low_deg - 2.0 * ramp_deg;
    let turn_deg = free_deg.clamp(360.0, MOST_TURN);
    // The limits are given in the controller's own coordinates.
    let status = table.status()?;
    let zero = status.machine_deg - status.angle_deg;
    let latest = high_deg - zero - ramp_deg - turn_deg;
    let earliest = low_deg - zero + ramp_deg;
    let start_deg = home_deg.min(latest).max(earliest);
    if (start_deg - home_deg).abs() > identity.step_deg() {
        table.jog(start_deg - home_deg, None)?;
    }
    let request = TurnRequest {
        degrees_per_second: speed,
        turn_deg,
        margin_deg: MARGIN_DEG,
        direction: None,
        unwind: false,
    };
    Ok(TurnPlan::new(identity, &table.status()?, &request)?)
}
