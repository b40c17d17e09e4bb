//! One capture: preflight, the turn with its recording, the verdict; and all of it again where the take is not
//! usable.
//!
//! The session is closed before the table turns back: from then on the take stands, whatever happens
//! to the table or the program.
//!
//! Whatever ends a take, the table stands when it is over: a [`relit_turntable::Turn`] that is
//! dropped stops it, a [`super::StopRequest`] reaches it while something waits for it, and the table
//! itself stops when the program ends.

use std::time::Duration;

use jiff::Timestamp;
use relit_data::causes::with_causes;
use relit_data::turn_light::MIN_MODULATION;

use super::calibrate::read_facts;
use super::context::CaptureContext;
use super::equipment::Equipment;
use super::error::CaptureError;
use super::locked_camera::{LockedCamera, NEXT_FRAME};
use super::manifest::manifest;
use super::preflight;
use super::recording::{EndReason, Recorder, RecordingPlan};
use super::turn::{TurnRecording, unwind};
use crate::state::{Check, Phase, TakeSummary, Verdict};
use relit_camera::CameraAddress;
use relit_turntable::{AngleFit, TurnPlan};

/// How long a replayed camera waits for the disk, so that a rehearsal on a slow disk loses nothing.
const REPLAY_WAIT: Duration = Duration::from_secs(60);

/// What a capture left.
#[derive(Debug, Clone, PartialEq)]
pub struct CaptureOutcome {
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
    object: &str,
    context: CaptureContext<'_>,
) -> Result<CaptureOutcome, CaptureError> {
    let clock = equipment.clock();
    let _part = clock.participate();
    preflight::check_object(object).map_err(CaptureError::Refused)?;
    let retries = equipment.settings().retries;
    let mut repeated = 0;
    loop {
        let (take, repeatable) = run_take(equipment, object, context)?;
        if take.verdict != Verdict::Aborted || !repeatable || repeated == retries {
            return Ok(CaptureOutcome { take, repeated });
        }
        repeated += 1;
        let fault = format!("the take is repeated: {}", take.reason.unwrap_or_default());
        context.monitor.fault(clock.now_us(), fault);
    }
}

/// One take, and whether its camera and table are good for another one.
fn run_take(
    equipment: &mut Equipment,
    object: &str,
    context: CaptureContext<'_>,
) -> Result<(TakeSummary, bool), CaptureError> {
    let begun = equipment.session_time(object);
    context.begin_take(object);
    context.note([preflight::check_clock(begun)?]);
    let (locked, turn) = prepare(equipment, context)?;
    let plan = plan_recording(equipment, object, begun, &locked, context)?;
    let clock = equipment.clock();
    let turn_us = equipment.settings().turn_us();
    let camera = equipment
        .camera
        .take()
        .ok_or_else(CaptureError::no_camera)?;
    let recorder = Recorder::start(camera, plan)?;
    let recording = TurnRecording {
        recorder: &recorder,
        clock: clock.clone(),
        turn_us,
        context,
    };
    let (track, finished) = match (equipment.table.as_ref(), turn) {
        (Some(table), Some(turn)) => match recording.with_table(table, turn) {
            Ok((track, finished)) => (track.map(Some).map_err(CaptureError::from), Some(finished)),
            Err(error) => (Err(error), None),
        },
        _ => (recording.without_table().map(|()| None), None),
    };
    recorder.stop();
    context.enter(Phase::Checking);
    let (mut camera, mut recorded) = recorder.wait()?;
    let control_faults = locked.plan.faults_after(&locked.controls, camera.as_mut());
    equipment.camera = Some(camera);
    let track = track.unwrap_or_else(|error| {
        // A camera that failed by itself explains the take better than the table that was stopped
        // for it.
        if matches!(recorded.end(), EndReason::Over | EndReason::Stopped) {
            let why = with_causes(&error);
            recorded.ended_by(match error {
                CaptureError::Stopped(_) => EndReason::OnPurpose(why),
                _ => EndReason::Interrupted(why),
            });
        }
        recorded
            .journal()
            .and_then(|journal| AngleFit::from_reports(&journal.turn, &journal.reports))
    });
    let mut repeatable = matches!(recorded.end(), EndReason::Over);
    let angle = |t_us| track.as_ref().and_then(|track| track.angle_at(t_us));
    // The session is closed before the table turns back: nothing that happens on the way costs it.
    let light = recorded.modulation().map(check_light);
    if let Some(light) = light.as_ref().filter(|light| !light.good) {
        recorded.add_note(light.found.clone());
    }
    let take = recorded.finish(&angle, &control_faults);
    if let Ok(take) = &take {
        if take.verdict != Verdict::Aborted {
            context.note(light);
        }
        context.end_take(take);
    }
    if let (Some(table), Some(finished)) = (equipment.table.as_ref(), finished) {
        repeatable &= unwind(table, finished, &clock, context).is_ok();
    }
    Ok((take?, repeatable))
}

/// Whether a turn in this light tells normals and albedo, and trains networks on what changes.
fn check_light(modulation: f64) -> Check {
    let percent = 100.0 * modulation;
    if modulation < MIN_MODULATION {
        let found = format!(
            "the light is too even: it changes by {percent:.0} % over the turn, but {:.0} % are needed; \
             turn on one lamp at the side, and capture the turn again",
            100.0 * MIN_MODULATION
        );
        return Check::noted("light", found);
    }
    Check::passed(
        "light",
        format!("it changes by {percent:.0} % over the turn"),
    )
}

/// What is recorded, and where; shows it.
fn plan_recording(
    equipment: &Equipment,
    object: &str,
    begun: Timestamp,
    locked: &LockedCamera,
    context: CaptureContext<'_>,
) -> Result<RecordingPlan, CaptureError> {
    let settings = equipment.settings();
    let rig = read_facts(&settings.root)?;
    let manifest = manifest(equipment, object, begun, locked, rig);
    context.monitor.update(|state| {
        state.session = Some(manifest.id.clone());
        state.frames_wanted = settings.frames(locked.stream.fps);
    });
    Ok(RecordingPlan {
        manifest,
        root: settings.root.clone(),
        stream: locked.stream,
        max_dropped: settings.max_dropped,
        queue_wait: match settings.camera {
            CameraAddress::Replay(_) => REPLAY_WAIT,
            _ => Duration::ZERO,
        },
        stall: NEXT_FRAME,
        clock: equipment.clock(),
        preview: context.preview.cloned(),
    })
}

/// Opens, checks and locks what a take needs, before the table turns for it.
fn prepare(
    equipment: &mut Equipment,
    context: CaptureContext<'_>,
) -> Result<(LockedCamera, Option<TurnPlan>), CaptureError> {
    let settings = equipment.settings().clone();
    if let Some(table) = equipment.open_table()? {
        preflight::check_speed(table, settings.degrees_per_second)?;
    }
    equipment.open_camera()?;
    let (Some(camera), table) = (equipment.camera.as_mut(), equipment.table.as_ref()) else {
        return Err(CaptureError::no_camera());
    };
    let camera = camera.as_mut();
    let locked = LockedCamera::lock(camera, &settings, context.stop)?;
    context.note(locked.checks.clone());
    let needed = locked.bytes_for(settings.frames(locked.stream.fps));
    context.monitor.update(|state| state.needed_bytes = needed);
    context.note([preflight::check_disk(&settings.root, needed)?]);
    let Some(table) = table else {
        return Ok((locked, None));
    };
    let stop = context.stop;
    let ready = stop.over(table, || preflight::ready_table(table));
    context.note(stop.explain(ready)?);
    let (turn, check) = preflight::plan_turn(table, &settings)?;
    context.note([check]);
    Ok((locked, Some(turn)))
}
