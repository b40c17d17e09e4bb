//! One capture: preflight, metering where it is asked for, the turn with its recording, the
//! verdict; and all of it again where the take is not usable.
//!
//! Whatever ends a take, the table stands when it is over: a [`crate::turntable::Turn`] that is
//! dropped stops it, a [`StopRequest`] reaches it while something waits for it, and the [`Table`]
//! itself stops when the program ends.

use std::time::Duration;

use jiff::Timestamp;
use relit_data::causes::with_causes;

use super::equipment::Equipment;
use super::error::{CaptureError, Refusal};
use super::locked_camera::{LockedCamera, NEXT_FRAME};
use super::manifest::manifest;
use super::metering::meter;
use super::preflight;
use super::recording::{End, Plan, Recorder};
use super::settings::Settings;
use super::stop::StopRequest;
use super::turn::TurnRecording;
use crate::camera::{Camera, CameraAddress};
use crate::preview::Preview;
use crate::state::{Check, Monitor, Phase, TakeSummary, Verdict};
use crate::turntable::{Table, TurnPlan};

/// How long a replayed camera waits for the disk, so that a rehearsal on a slow disk loses nothing.
const REPLAY_WAIT: Duration = Duration::from_secs(60);

/// What is to be captured.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CaptureRequest {
    /// The object's name.
    pub object: String,
    /// Whether a metering turn comes first.
    pub meter: bool,
}

/// Who follows a capture, and who may stop it.
#[derive(Debug, Clone, Copy)]
pub struct CaptureContext<'a> {
    /// Gets the state.
    pub monitor: &'a Monitor,
    /// Gets the frames.
    pub preview: Option<&'a Preview>,
    /// May be asked for at any time.
    pub stop: &'a StopRequest,
}

impl CaptureContext<'_> {
    pub(super) fn enter(&self, phase: Phase) {
        self.monitor.update(|state| state.phase = phase);
    }

    fn note(&self, checks: impl IntoIterator<Item = Check>) {
        self.monitor.update(|state| state.checks.extend(checks));
    }

    /// Shows that a take of `object` begins.
    fn begin_take(&self, object: &str) {
        self.monitor.update(|state| {
            state.phase = Phase::Preflight;
            state.object = Some(object.to_owned());
            (state.frames, state.frames_wanted, state.dropped) = (0, 0, 0);
            state.checks.clear();
            state.session = None;
        });
    }
}

/// What a capture left.
#[derive(Debug, Clone, PartialEq)]
pub struct Captured {
    /// The last take, which counts.
    pub take: TakeSummary,
    /// Takes before it that are not usable, and are kept.
    pub repeated: u32,
}

/// Captures one turn of an object. A take that is not usable is kept, marked as aborted, and
/// repeated as often as the settings say, where its camera and table still work.
///
/// # Errors
/// What keeps a take from beginning. What spoiled one that began is in its summary.
pub fn capture(
    equipment: &mut Equipment,
    request: &CaptureRequest,
    context: CaptureContext<'_>,
) -> Result<Captured, CaptureError> {
    let clock = equipment.clock();
    let _part = clock.take_part();
    preflight::check_object(&request.object)?;
    let retries = equipment.settings().retries;
    let mut repeated = 0;
    loop {
        let begun = equipment.session_time();
        // The exposure that a first take found stays set.
        let meter = request.meter && repeated == 0;
        let (take, repeatable) = run_take(equipment, &request.object, meter, begun, context)?;
        let last_take = Some(take.clone());
        context.monitor.update(|state| state.last_take = last_take);
        if take.verdict != Verdict::Aborted || !repeatable || repeated == retries {
            return Ok(Captured { take, repeated });
        }
        repeated += 1;
        let reason = take.reason.unwrap_or_default();
        let now_us = clock.now_us();
        let fault = format!("the take is repeated: {reason}");
        context.monitor.fault(now_us, fault);
    }
}

/// One take, and whether its camera and table are good for another one.
fn run_take(
    equipment: &mut Equipment,
    object: &str,
    meter: bool,
    begun: Timestamp,
    context: CaptureContext<'_>,
) -> Result<(TakeSummary, bool), CaptureError> {
    context.begin_take(object);
    let prepared = prepare(equipment, object, meter, begun, context)?;
    let camera = equipment.camera.take().ok_or(CaptureError::NoCamera)?;
    let session = prepared.plan.manifest.id.clone();
    let recorder = Recorder::start(camera, prepared.plan)?;
    context.monitor.update(|state| {
        state.session = Some(session);
        state.frames_wanted = prepared.frames;
    });
    let recording = TurnRecording {
        recorder: &recorder,
        clock: equipment.clock(),
        turn_us: equipment.settings().turn_us(),
        context,
    };
    let turned = match (equipment.table.as_ref(), prepared.turn) {
        (Some(table), Some(turn)) => recording.with_table(table, turn).map(Some),
        _ => recording.without_table().map(|()| None),
    };
    recorder.stop();
    context.enter(Phase::Checking);
    let (mut camera, mut recorded) = recorder.wait()?;
    let locked = &prepared.locked;
    let read_back = locked.plan.read_back(&locked.controls, camera.as_mut());
    equipment.camera = Some(camera);
    // A camera that failed by itself explains the take better than the table that was stopped for
    // it.
    let by_recorder = !matches!(recorded.end(), End::Over | End::Stopped);
    let track = match turned {
        Ok(track) => track,
        Err(_) if by_recorder => None,
        Err(error) => {
            recorded.interrupted(with_causes(&error));
            None
        }
    };
    let repeatable = matches!(recorded.end(), End::Over);
    let angle = |t_us| track.as_ref().and_then(|track| track.angle_at(t_us));
    Ok((recorded.finish(&angle, &read_back.faults())?, repeatable))
}

/// What a take needs before the table turns for it.
struct Prepared {
    locked: LockedCamera,
    turn: Option<TurnPlan>,
    plan: Plan,
    frames: u64,
}

fn prepare(
    equipment: &mut Equipment,
    object: &str,
    meter: bool,
    begun: Timestamp,
    context: CaptureContext<'_>,
) -> Result<Prepared, CaptureError> {
    let settings = equipment.settings().clone();
    context.note([preflight::check_clock(begun)?]);
    equipment.open_table()?;
    equipment.open_camera()?;
    let (Some(camera), table) = (equipment.camera.as_mut(), equipment.table.as_ref()) else {
        return Err(CaptureError::NoCamera);
    };
    let camera = camera.as_mut();
    let mut locked = LockedCamera::lock(camera, &settings, context.stop)?;
    context.note(locked.checks.clone());
    let frames = settings.frames(locked.fps());
    let needed = locked.bytes_for(frames);
    context.monitor.update(|state| state.needed_bytes = needed);
    context.note([preflight::check_disk(&settings.root, needed)?]);
    let turn = match table {
        Some(table) => Some(prepare_table(
            camera,
            table,
            &mut locked,
            &settings,
            meter,
            context,
        )?),
        None if meter => return Err(Refusal::MeterWithoutTable.into()),
        None => None,
    };
    let queue_wait = match settings.camera {
        CameraAddress::Replay { .. } => REPLAY_WAIT,
        _ => Duration::ZERO,
    };
    let plan = Plan {
        manifest: manifest(equipment, object, begun, &locked),
        root: settings.root,
        mode: locked.mode,
        fps: locked.fps(),
        window: None,
        max_dropped: settings.max_dropped,
        queue_wait,
        stall: NEXT_FRAME,
        clock: equipment.clock(),
        preview: context.preview.cloned(),
    };
    Ok(Prepared {
        locked,
        turn,
        plan,
        frames,
    })
}

/// Makes the table ready, meters where it is asked for, and plans the turn.
fn prepare_table(
    camera: &mut dyn Camera,
    table: &Table,
    locked: &mut LockedCamera,
    settings: &Settings,
    with_metering: bool,
    context: CaptureContext<'_>,
) -> Result<TurnPlan, CaptureError> {
    let stop = context.stop;
    let ready = stop.over(table, || preflight::ready_table(table, settings));
    context.note(stop.explain(ready)?);
    if with_metering {
        context.enter(Phase::Metering);
        let exposure = meter(camera, table, locked, settings, stop)?;
        let found = format!("metered: {exposure}");
        context.note([Check::passed("exposure", found)]);
    }
    let (turn, check) = preflight::plan_turn(table, settings)?;
    context.note([check]);
    Ok(turn)
}
