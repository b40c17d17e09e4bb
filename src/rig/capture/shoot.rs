//! One capture: preflight, metering where it is asked for, the turn with its recording, the verdict;
//! and all of it once more where a take came out bad.
//!
//! Whatever ends a take, the table stands when it is over: a [`Turn`] that is dropped stops it, a
//! [`StopRequest`] reaches it while something waits for it, and the [`Table`] itself stops when the
//! program ends.

use std::time::Duration;

use jiff::Timestamp;

use super::equipment::Equipment;
use super::facts::manifest;
use super::failure::CaptureError;
use super::preflight::{self, Held};
use super::settings::Settings;
use super::stop::StopRequest;
use super::tracking::Course;
use super::{End, Ended, Plan, Recorder, Refusal, Report, Take, WhenFull, metering};
use crate::camera::{Camera, CameraAddress};
use crate::daemon::Viewer;
use crate::state::{Check, Monitor, Phase, TakeSummary};
use crate::turntable::{Table, TurnPlan};

/// Longest wait of a second session name's turn: names have whole seconds.
const NAME_WAIT: Duration = Duration::from_millis(1100);

/// What is to be captured.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Order {
    /// The object's name.
    pub object: String,
    /// Whether a metering turn comes first.
    pub meter: bool,
}

/// Who looks on while a capture goes on, and who may stop it.
#[derive(Debug, Clone, Copy)]
pub struct Onlookers<'a> {
    /// Told of everything.
    pub monitor: &'a Monitor,
    /// Shown the newest frames.
    pub viewer: Option<&'a Viewer>,
    /// Asked all the time.
    pub stop: &'a StopRequest,
}

/// Captures one turn of an object. A take that came out bad is kept, marked as aborted, and repeated
/// as often as the settings say, where its camera and table are still good for it.
///
/// # Errors
/// What keeps a take from beginning. One that began and came out bad is told in its summary.
pub fn capture(
    equipment: &mut Equipment,
    order: &Order,
    on: Onlookers<'_>,
) -> Result<TakeSummary, CaptureError> {
    preflight::check_object(&order.object)?;
    let mut meter = order.meter;
    let mut left = equipment.settings().retries;
    loop {
        let (summary, worth_another) = one_take(equipment, &order.object, meter, on)?;
        on.monitor
            .update(|state| state.last_take = Some(summary.clone()));
        let Some(reason) = summary.reason.clone().filter(|_| worth_another && left > 0) else {
            return Ok(summary);
        };
        left -= 1;
        // The exposure that was found stays set.
        meter = false;
        let now_us = equipment.clock().now_us();
        on.monitor
            .fault(now_us, format!("the take is repeated: {reason}"));
        std::thread::sleep(NAME_WAIT);
    }
}

/// One take, and whether another one might come out better.
fn one_take(
    equipment: &mut Equipment,
    object: &str,
    meter: bool,
    on: Onlookers<'_>,
) -> Result<(TakeSummary, bool), CaptureError> {
    on.monitor.update(|state| {
        state.phase = Phase::Preflight;
        state.object = Some(object.to_owned());
        (state.frames, state.frames_wanted, state.dropped) = (0, 0, 0);
        state.checks.clear();
        state.session = None;
    });
    let ready = get_ready(equipment, object, meter, on)?;
    let recorder = match equipment.camera.take() {
        Some(camera) => Recorder::start(camera, ready.record.clone())?,
        None => return Err(CaptureError::NoCamera),
    };
    on.monitor.update(|state| {
        state.session = Some(ready.record.manifest.id.clone());
        state.frames_wanted = ready.frames;
    });
    let course = Course {
        recorder: &recorder,
        clock: equipment.clock(),
        turn_us: equipment.settings().turn_us(),
        on,
    };
    let turned = match (equipment.table.as_ref(), ready.turn) {
        (Some(table), Some(plan)) => course.with_table(table, plan).map(Some),
        _ => course.without_table().map(|()| None),
    };
    recorder.stop();
    on.monitor.update(|state| state.phase = Phase::Checking);
    let (mut camera, ended) = recorder.wait()?;
    let held = &ready.held;
    let moved = held.plan.read_back(&held.controls, camera.as_mut());
    equipment.camera = Some(camera);
    let (ended, track) = match turned {
        Ok(track) => (ended, track),
        Err(error) => (blame(ended, &error), None),
    };
    let over = matches!(ended.end(), End::Over);
    let angle = |t_us| track.as_ref().and_then(|track| track.angle_at(t_us));
    let report = ended.finish(&angle, &moved.faults())?;
    Ok((summary_of(&report), over))
}

/// A camera that failed by itself explains the take better than the table that was stopped for it.
fn blame(ended: Ended, error: &CaptureError) -> Ended {
    match ended.end() {
        End::Over | End::Stopped => ended.because_of(error.to_string()),
        _ => ended,
    }
}

/// What preflight gives a take.
struct Ready {
    held: Held,
    turn: Option<TurnPlan>,
    record: Plan,
    frames: u64,
}

fn get_ready(
    equipment: &mut Equipment,
    object: &str,
    meter: bool,
    on: Onlookers<'_>,
) -> Result<Ready, CaptureError> {
    let settings = equipment.settings().clone();
    let now = Timestamp::now();
    note(on, [preflight::check_clock(now)?]);
    equipment.open_table()?;
    equipment.open_camera()?;
    let (Some(camera), table) = (equipment.camera.as_mut(), equipment.table.as_ref()) else {
        return Err(CaptureError::NoCamera);
    };
    let camera = camera.as_mut();
    let mut held = preflight::hold_camera(camera, &settings, on.stop)?;
    note(on, held.checks.clone());
    let frames = settings.frames(held.fps());
    let needed = held.bytes_for(frames);
    on.monitor.update(|state| state.needed_bytes = needed);
    note(on, [preflight::check_disk(&settings.root, needed)?]);
    let turn = ready_to_turn(camera, table, &mut held, &settings, meter, on)?;
    let manifest = manifest(equipment, object, now, &held);
    let record = Plan {
        root: settings.root.clone(),
        manifest,
        mode: held.mode,
        fps: held.fps(),
        window: None,
        max_dropped: settings.max_dropped,
        when_full: when_full(&settings),
        stall: preflight::frame_patience(&equipment.clock()),
    };
    Ok(Ready {
        held,
        turn,
        record,
        frames,
    })
}

/// Makes the table ready, meters where it is asked for, and plans the turn.
fn ready_to_turn(
    camera: &mut dyn Camera,
    table: Option<&Table>,
    held: &mut Held,
    settings: &Settings,
    meter: bool,
    on: Onlookers<'_>,
) -> Result<Option<TurnPlan>, CaptureError> {
    let Some(table) = table else {
        return match meter {
            true => Err(Refusal::MeterWithoutTable.into()),
            false => Ok(None),
        };
    };
    let ready = on
        .stop
        .over(table, || preflight::ready_table(table, settings));
    on.stop.check()?;
    note(on, ready?);
    if meter {
        on.monitor.update(|state| state.phase = Phase::Metering);
        let metered = metering::meter(camera, table, held, settings, on.stop);
        // A wish to stop explains better why the table did not go on.
        on.stop.check()?;
        note(
            on,
            [Check::passed("exposure", format!("metered: {}", metered?))],
        );
    }
    let (turn, check) = preflight::plan_turn(table, settings)?;
    note(on, [check]);
    Ok(Some(turn))
}

/// A replayed camera can wait for the disk, and a rehearsal on a slow disk loses nothing.
fn when_full(settings: &Settings) -> WhenFull {
    match settings.camera {
        CameraAddress::Replay { .. } => WhenFull::Wait,
        _ => WhenFull::Drop,
    }
}

fn note(on: Onlookers<'_>, checks: impl IntoIterator<Item = Check>) {
    on.monitor.update(|state| state.checks.extend(checks));
}

fn summary_of(report: &Report) -> TakeSummary {
    use crate::state::Verdict;
    let lost = report
        .missing
        .iter()
        .map(|missing| missing.count)
        .sum::<u64>()
        + (report.overrun.len() + report.left_out.len()) as u64;
    let (verdict, reason) = match &report.take {
        Take::Clean => (Verdict::Clean, None),
        Take::Tolerated => (Verdict::Tolerated, first_fault(report)),
        Take::Bad { reason } => (Verdict::Aborted, Some(reason.clone())),
    };
    TakeSummary {
        session: report.manifest.id.clone(),
        verdict,
        frames: report.recorded,
        dropped: lost,
        reason,
    }
}

fn first_fault(report: &Report) -> Option<String> {
    report
        .manifest
        .faults
        .first()
        .map(|fault| fault.what.clone())
}
