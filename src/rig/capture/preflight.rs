//! What is checked and set before anything turns.
//!
//! Every check that is passed leaves a line for the person at the rig; one that is not ends the
//! capture with a [`Refusal`] before the table moves for it. Only an unknown zero of the table is mended
//! here: the table is homed.

use std::path::Path;
use std::time::Duration;

use jiff::Timestamp;

use super::failure::{CaptureError, Refusal};
use super::settings::Settings;
use super::stop::StopRequest;
use crate::camera::hold::{ManualPlan, MissingControl};
use crate::camera::{Camera, Control, GrantedMode, ModeRequest};
use crate::clock::Clock;
use crate::state::Check;
use crate::turntable::{Homed, Table, TurnPlan, TurnRequest};
use relit_data::naming::is_session_name;
use relit_data::session::FrameClock;

/// How long the first frame may take, of real time.
const FIRST_FRAME: Duration = Duration::from_secs(5);
/// How long each further one may take, of real time.
const NEXT_FRAME: Duration = Duration::from_secs(2);
/// Frames that are looked at: as many as an automatic needs to find its values.
const LOOKED_AT: usize = 30;
/// Frames until new settings show.
const SETTLING: usize = 10;
/// What is added to the size that a take is expected to have, as a part of it.
const RESERVE: f64 = 0.2;
/// Bytes of a frame's line in the index.
const INDEX_LINE: f64 = 90.0;
/// Bytes of manifest and of the video's own tables.
const AROUND: f64 = 1e6;
/// Degrees at constant speed on either side of the turn.
const MARGIN_DEG: f64 = 2.0;
/// Longest object name, bytes: with date and time a session's name still has room.
const LONGEST_OBJECT: usize = 80;
/// 2025-01-01, seconds since 1970.
const EARLIEST: i64 = 1_735_689_600;

/// A camera that streams in its mode with its settings held.
#[derive(Debug, Clone)]
pub struct Held {
    /// What was asked for.
    pub request: ModeRequest,
    /// What was granted.
    pub mode: GrantedMode,
    /// The settings that hold it.
    pub plan: ManualPlan,
    /// All controls, as read back.
    pub controls: Vec<Control>,
    /// What stamps its frames.
    pub clock: FrameClock,
    /// Mean size of a frame, bytes.
    pub frame_bytes: f64,
    /// What was found.
    pub checks: Vec<Check>,
}

impl Held {
    /// Frames a second: what was granted, or, where the camera does not say, what was asked for.
    #[must_use]
    pub fn fps(&self) -> f64 {
        self.mode.rate.unwrap_or(self.request.rate).per_second()
    }

    /// Bytes that so many frames are expected to take on disk.
    #[must_use]
    pub fn bytes_for(&self, frames: u64) -> u64 {
        let each = self.frame_bytes + INDEX_LINE;
        (frames as f64 * each + AROUND).ceil() as u64
    }
}

/// Starts the camera in the mode wished, looks at its first frames, and holds its settings.
///
/// # Errors
/// [`Refusal::NoMode`], [`Refusal::OtherMode`], [`Refusal::Damaged`], [`Refusal::NotKept`], a wish
/// to stop, or what the camera answers.
pub fn hold_camera(
    camera: &mut dyn Camera,
    settings: &Settings,
    stop: &StopRequest,
) -> Result<Held, CaptureError> {
    let request = settings.mode.choose(&camera.modes()?)?;
    let mode = camera.start(&request)?;
    let mut checks = vec![mode_check(&request, &mode)?];
    let frame_bytes = look_at_frames(camera, stop)?;
    let plan = ManualPlan::new(&camera.controls()?, &settings.wanted);
    let not_held = plan.without(&settings.wanted);
    if !not_held.is_empty() {
        return Err(Refusal::NotHeld(not_held).into());
    }
    let moved = plan.apply(camera)?;
    if !moved.is_empty() {
        return Err(Refusal::NotKept(moved).into());
    }
    let clock = pass_over(camera, SETTLING, stop)?;
    let controls = camera.controls()?;
    let moved = plan.check(&controls);
    if !moved.is_empty() {
        return Err(Refusal::NotKept(moved).into());
    }
    checks.push(settings_check(&plan));
    checks.extend(plan.missing.iter().map(missing_check));
    Ok(Held {
        request,
        mode,
        plan,
        controls,
        clock,
        frame_bytes,
        checks,
    })
}

fn mode_check(request: &ModeRequest, mode: &GrantedMode) -> Result<Check, Refusal> {
    let asked_rate = GrantedMode {
        rate: mode.rate.or(Some(request.rate)),
        ..*mode
    };
    let differences = asked_rate.differences(request);
    if !differences.is_empty() {
        return Err(Refusal::OtherMode(differences));
    }
    Ok(match mode.rate {
        Some(_) => Check::passed("camera mode", mode.to_string()),
        None => Check::noted(
            "camera mode",
            format!("{request}; the camera does not say at which rate it runs"),
        ),
    })
}

/// Looks at the first frames, while automatics find their values; gives the mean size of those
/// that are whole.
fn look_at_frames(camera: &mut dyn Camera, stop: &StopRequest) -> Result<f64, CaptureError> {
    let (mut bytes, mut whole) = (0.0, 0_u32);
    let mut why = None;
    for n in 0..LOOKED_AT {
        stop.check()?;
        let patience = if n == 0 { FIRST_FRAME } else { NEXT_FRAME };
        let frame = camera.next_frame(patience)?;
        match frame.fault() {
            // The first frames after a start may be cut: that is no fault of the camera.
            Some(fault) => why = Some(fault.to_string()),
            None => {
                bytes += frame.data.len() as f64;
                whole += 1;
            }
        }
    }
    match (whole, why) {
        (0, why) => Err(Refusal::Damaged {
            frames: LOOKED_AT,
            why: why.unwrap_or_default(),
        }
        .into()),
        (whole, _) => Ok(bytes / f64::from(whole)),
    }
}

/// Passes over frames; gives what stamps them.
fn pass_over(
    camera: &mut dyn Camera,
    frames: usize,
    stop: &StopRequest,
) -> Result<FrameClock, CaptureError> {
    let mut clock = FrameClock::default();
    for _ in 0..frames {
        stop.check()?;
        clock = camera.next_frame(NEXT_FRAME)?.stamp.clock();
    }
    Ok(clock)
}

fn settings_check(plan: &ManualPlan) -> Check {
    if plan.steps.is_empty() {
        let words = "the camera has no settings that could be held";
        return Check::noted("camera settings", words);
    }
    let held: Vec<String> = plan
        .steps
        .iter()
        .map(|step| format!("{} {}", step.name, step.value))
        .collect();
    Check::passed("camera settings", held.join(", "))
}

fn missing_check(lack: &MissingControl) -> Check {
    Check::noted("camera settings", lack.to_string())
}

/// Checks that the disk has room for a take, and a fifth more.
///
/// # Errors
/// [`Refusal::DiskFull`] with both numbers, or what the file system answers.
pub fn check_disk(root: &Path, expected: u64) -> Result<Check, CaptureError> {
    let free = free_bytes(root)?;
    let needed = (expected as f64 * (1.0 + RESERVE)).ceil() as u64;
    if free < needed {
        return Err(Refusal::DiskFull {
            folder: root.to_owned(),
            free,
            needed,
        }
        .into());
    }
    let (free, needed) = (free / 1_000_000, needed.div_ceil(1_000_000));
    let words = format!("{free} MB free, {needed} MB needed");
    Ok(Check::passed("disk", words))
}

/// Bytes that this user may still write in a folder.
///
/// # Errors
/// What the file system answers.
pub fn free_bytes(root: &Path) -> Result<u64, CaptureError> {
    let asked = rustix::fs::statvfs(root);
    let told = asked.map_err(|errno| {
        CaptureError::system(root.display().to_string(), "asked for its room")(errno.into())
    })?;
    Ok(told.f_bavail.saturating_mul(told.f_frsize))
}

/// Checks that the time of day is one in which this program can run.
///
/// # Errors
/// [`Refusal::Clock`].
pub fn check_clock(now: Timestamp) -> Result<Check, Refusal> {
    if now.as_second() < EARLIEST {
        return Err(Refusal::Clock {
            now: now.to_string(),
        });
    }
    Ok(Check::passed("clock", format!("{now:.0}")))
}

/// Checks that an object's name can be part of a session's.
///
/// # Errors
/// [`Refusal::Object`].
pub fn check_object(name: &str) -> Result<(), Refusal> {
    if is_session_name(name) && name.len() <= LONGEST_OBJECT {
        return Ok(());
    }
    Err(Refusal::Object(name.to_owned()))
}

/// Makes sure that the table can turn: it answers, knows its zero (or is homed now), and its
/// battery is good for it.
///
/// # Errors
/// [`Refusal::Battery`], [`Refusal::NoBattery`], or what the table answers.
pub fn ready_table(table: &Table, settings: &Settings) -> Result<Vec<Check>, CaptureError> {
    let status = table.status()?;
    let mut checks = Vec::new();
    if let Some(least) = settings.min_battery_v {
        let volts = status.battery_v.ok_or(Refusal::NoBattery)?;
        if volts < least {
            return Err(Refusal::Battery { volts, least }.into());
        }
        checks.push(Check::passed("battery", format!("{volts:.2} V")));
    }
    let firmware = &table.identity().firmware;
    checks.push(Check::passed("table", format!("Grbl {firmware} answers")));
    checks.push(match status.homed {
        true => Check::passed("table's zero", "known"),
        false => match table.home()? {
            Homed::Index => Check::passed("table's zero", "found at its index"),
            Homed::WhereItStands => Check::noted(
                "table's zero",
                "taken where the table stood: it has no index",
            ),
        },
    });
    Ok(checks)
}

/// Plans the turn of a take from where the table stands.
///
/// # Errors
/// No room inside the limits, or a speed that the table cannot follow.
pub fn plan_turn(table: &Table, settings: &Settings) -> Result<(TurnPlan, Check), CaptureError> {
    let request = TurnRequest {
        degrees_per_second: settings.degrees_per_second,
        turn_deg: 360.0,
        margin_deg: MARGIN_DEG,
        direction: None,
        unwind: true,
    };
    let plan = TurnPlan::new(table.identity(), &table.status()?, &request)?;
    let words = format!(
        "room for the turn from {:.1} to {:.1} degrees",
        plan.back_deg(),
        plan.end_deg()
    );
    Ok((plan, Check::passed("cable", words)))
}

/// Time at constant speed before the turn's first frame, microseconds.
#[must_use]
pub fn margin_us(plan: &TurnPlan) -> i64 {
    (MARGIN_DEG / plan.degrees_per_second() * 1e6).round() as i64
}

/// Without a frame for so long, of real time, a camera counts as failed; a rehearsal slower than
/// real time has longer.
#[must_use]
pub fn frame_patience(clock: &Clock) -> Duration {
    NEXT_FRAME.max(clock.real(NEXT_FRAME))
}
