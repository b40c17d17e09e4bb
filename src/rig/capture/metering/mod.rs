//! The metering turn: the table turns slowly, and the [`Meter`] says what exposure to set.

use std::time::Duration;

use super::failure::{CaptureError, MeterFault};
use super::look::{clipped, middle};
use super::meter::{Advice, Exposures, Meter};
use super::preflight::Held;
use super::settings::Settings;
use super::stop::StopRequest;
use crate::camera::hold::{Aspect, ControlSetting};
use crate::camera::{Camera, Control, Frame};
use crate::turntable::{Table, Turn, TurnPlan, TurnRequest};
use relit_video::LiveDecoder;

/// Degrees that the table turns from one frame to the next, at most: two frames of each degree.
const DEGREES_A_FRAME: f64 = 0.48;
/// How far the meter may turn, degrees: two turns.
const MOST_TURN: f64 = 720.0;
/// Speed constant on either side of it, degrees.
const MARGIN_DEG: f64 = 1.0;
/// Frames until a new exposure shows in every one of them.
const LATE_FRAMES: usize = 6;
/// Units of `exposure_time_absolute` in a second.
const EXPOSURE_UNITS: f64 = 10_000.0;
/// Names of controls whose unit that is.
const TIMED: [&str; 2] = ["exposure_time_absolute", "exposure_absolute"];
/// How long a frame may take, of real time.
const NEXT_FRAME: Duration = Duration::from_secs(2);

/// Turns the table slowly, finds the exposure, and leaves the camera set to it; the table is back
/// where it stood. The camera streams before and after.
///
/// # Errors
/// [`MeterFault`], a wish to stop, or what camera and table answer; the table has been stopped.
pub(super) fn meter(
    camera: &mut dyn Camera,
    table: &Table,
    held: &mut Held,
    settings: &Settings,
    stop: &StopRequest,
) -> Result<i64, CaptureError> {
    let at = held.plan.steps.iter().position(is_exposure);
    let at = at.ok_or(MeterFault::NoExposure)?;
    let exposures = exposures(&held.controls, &held.plan.steps[at], held.fps());
    let mut eye = Eye {
        meter: Meter::new(
            exposures.ok_or(MeterFault::NoExposure)?,
            settings.meter_clip,
        ),
        step: held.plan.steps[at].clone(),
        decoder: decoder_for(held)?,
        late: LATE_FRAMES,
    };
    eye.set(camera)?;
    let found = stop.over(table, || turn_and_look(camera, table, held, &mut eye, stop))?;
    held.plan.steps[at].value = found;
    held.controls = camera.controls()?;
    let moved = held.plan.check(&held.controls);
    if !moved.is_empty() {
        return Err(super::failure::Refusal::NotKept(moved).into());
    }
    Ok(found)
}

fn is_exposure(step: &ControlSetting) -> bool {
    step.aspect == Aspect::Exposure
        && (TIMED.contains(&step.name.as_str()) || step.name == "exposure")
}

/// The exposures of a control that fit into a frame's time, where its unit is known; else all.
fn exposures(controls: &[Control], step: &ControlSetting, fps: f64) -> Option<Exposures> {
    let control = controls.iter().find(|control| control.id == step.id)?;
    let spacing = i64::try_from(control.step.max(1)).ok()?;
    let darkest = control.minimum.max(1);
    let longest = match TIMED.contains(&step.name.as_str()) {
        true => control.maximum.min((EXPOSURE_UNITS / fps) as i64),
        false => control.maximum,
    };
    let steps = longest.checked_sub(darkest)?.max(0) / spacing;
    Some(Exposures {
        darkest,
        brightest: darkest.checked_add(steps.checked_mul(spacing)?)?,
        step: spacing,
    })
}

fn decoder_for(held: &Held) -> Result<LiveDecoder, CaptureError> {
    let none = |why: String| CaptureError::from(MeterFault::NoPicture(why));
    let format = held.mode.fourcc.pixel_format();
    let format = format.ok_or_else(|| none(held.mode.fourcc.to_string()))?;
    LiveDecoder::new(format, held.mode.width, held.mode.height)
        .map_err(|fault| none(fault.to_string()))
}

/// What looks at the frames.
struct Eye {
    meter: Meter,
    step: ControlSetting,
    decoder: LiveDecoder,
    /// Frames that are still to be passed over.
    late: usize,
}

impl Eye {
    /// Sets the meter's exposure.
    fn set(&mut self, camera: &mut dyn Camera) -> Result<(), CaptureError> {
        let set = self.meter.exposure();
        let read = camera.set_control(self.step.id, set)?;
        if read != set {
            return Err(MeterFault::NotTaken { set, read }.into());
        }
        self.late = LATE_FRAMES;
        Ok(())
    }

    /// The part of the middle that saturates; `None` of a frame that is damaged or has no say.
    fn clipped(&mut self, frame: &Frame) -> Option<f64> {
        // Frames that build on others have to be decoded all.
        let picture = self.decoder.decode(&frame.data).ok()??;
        if self.late > 0 {
            self.late -= 1;
            return None;
        }
        let (width, height) = picture.size();
        picture
            .rgb(middle(width, height))
            .ok()
            .map(|rgb| clipped(&rgb))
    }
}

fn turn_and_look(
    camera: &mut dyn Camera,
    table: &Table,
    held: &Held,
    eye: &mut Eye,
    stop: &StopRequest,
) -> Result<i64, CaptureError> {
    let home_deg = table.status()?.angle_deg;
    let plan = plan(table, held.fps(), home_deg)?;
    let mut turn = table.start_turn(plan)?;
    let found = look_around(camera, &mut turn, eye, stop);
    let stopped = turn.abort();
    let found = found?;
    let back_deg = home_deg - stopped?.angle_deg;
    table.jog(back_deg, None)?;
    Ok(found)
}

/// Two turns, or as much of them as the cable allows, but one at least; beginning where most of
/// the way is ahead.
fn plan(table: &Table, fps: f64, home_deg: f64) -> Result<TurnPlan, CaptureError> {
    let identity = table.identity();
    let speed = (DEGREES_A_FRAME * fps).min(identity.max_degrees_per_second);
    let ramp_deg = speed * speed / (2.0 * identity.acceleration) + MARGIN_DEG + 1.0;
    let limits = identity.limits;
    let room = limits.high_deg - limits.low_deg - 2.0 * ramp_deg;
    let turn_deg = room.clamp(360.0, MOST_TURN);
    let status = table.status()?;
    let zero = status.machine_deg - status.angle_deg;
    // The limits are the controller's; the way begins as close to where the table stands as it can.
    let latest = limits.high_deg - zero - ramp_deg - turn_deg;
    let earliest = limits.low_deg - zero + ramp_deg;
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

fn look_around(
    camera: &mut dyn Camera,
    turn: &mut Turn<'_>,
    eye: &mut Eye,
    stop: &StopRequest,
) -> Result<i64, CaptureError> {
    let part = turn.wait_constant()?;
    let speed = turn.plan().degrees_per_second();
    loop {
        stop.check()?;
        turn.state()?;
        let frame = camera.next_frame(NEXT_FRAME)?;
        if frame.t_us >= part.to_us {
            let degrees = eye.meter.left();
            return Err(MeterFault::Unseen { degrees }.into());
        }
        let Some(clipped) = eye.clipped(&frame) else {
            continue;
        };
        if frame.t_us < part.from_us {
            continue;
        }
        let gone_deg = (frame.t_us - part.from_us) as f64 / 1e6 * speed;
        match eye.meter.look(gone_deg, clipped)? {
            Advice::GoOn => {}
            Advice::Set(_) => eye.set(camera)?,
            Advice::Done(exposure) => return Ok(exposure),
        }
    }
}

#[cfg(test)]
mod tests;
