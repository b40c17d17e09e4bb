//! One capture: preflight, metering where it is asked for, the turn with its recording, the verdict;
//! and all of it once more where a take came out bad.
//!
//! Whatever ends a take, the table stands when it is over: a [`Turn`] that is dropped stops it, a
//! [`StopRequest`] reaches it while something waits for it, and the [`Table`] itself stops when the
//! program ends.

use std::collections::BTreeMap;
use std::time::Duration;

use jiff::Timestamp;
use serde_json::Value;

use super::equipment::Equipment;
use super::failure::CaptureError;
use super::preflight::{self, Held};
use super::state::{Check, Monitor, Phase, TakeSummary};
use super::stop::StopRequest;
use super::tracking::Course;
use super::viewer::Viewer;
use super::{End, Ended, Plan, Recorder, Report, Take, metering};
use crate::camera::lock::moved_between;
use crate::camera::{Camera, Control, ControlKind};
use crate::session::{CameraFacts, Manifest, SoftwareFacts, Status, TurntableFacts, VideoFacts};
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
    let moved = moved_since(&ready.held, camera.as_mut());
    equipment.camera = Some(camera);
    let (ended, track) = match turned {
        Ok(track) => (ended, track),
        Err(error) => (blame(ended, &error), None),
    };
    let over = matches!(ended.end(), End::Over);
    let angle = |t_us| track.as_ref().and_then(|track| track.angle_at(t_us));
    let report = ended.finish(&angle, &moved)?;
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
    let turn = match table {
        Some(table) => {
            note(
                on,
                on.stop
                    .over(table, || preflight::ready_table(table, &settings))?,
            );
            on.stop.check()?;
            if meter {
                on.monitor.update(|state| state.phase = Phase::Metering);
                let exposure = metering::meter(camera, table, &mut held, &settings, on.stop)?;
                note(
                    on,
                    [Check::passed("exposure", format!("metered: {exposure}"))],
                );
            }
            let (turn, check) = preflight::plan_turn(table, &settings)?;
            note(on, [check]);
            Some(turn)
        }
        None if meter => return Err(super::Refusal::MeterWithoutTable.into()),
        None => None,
    };
    let manifest = manifest(equipment, object, now, &held);
    let record = Plan {
        root: settings.root.clone(),
        manifest,
        mode: held.mode,
        fps: held.fps(),
        max_dropped: settings.max_dropped,
        stall: preflight::frame_patience(&equipment.clock()),
    };
    Ok(Ready {
        held,
        turn,
        record,
        frames,
    })
}

fn note(on: Onlookers<'_>, checks: impl IntoIterator<Item = Check>) {
    on.monitor.update(|state| state.checks.extend(checks));
}

fn manifest(equipment: &Equipment, object: &str, now: Timestamp, held: &Held) -> Manifest {
    let settings = equipment.settings();
    let camera = settings.camera.clone();
    let name = equipment
        .camera
        .as_ref()
        .map(|camera| camera.info().name.clone());
    Manifest {
        id: format!("{}-{object}", now.strftime("%Y%m%dT%H%M%SZ")),
        object: object.to_owned(),
        created: now,
        status: Status::Recording,
        camera: CameraFacts {
            backend: camera.backend().to_owned(),
            device: camera.device(),
            name: name.unwrap_or_default(),
            fourcc: held.mode.fourcc.to_string(),
            width: held.mode.width,
            height: held.mode.height,
            fps: held.fps(),
            controls: controls_by_name(&held.controls),
        },
        turntable: equipment
            .table
            .as_ref()
            .map(|table| facts_of(table, settings)),
        video: VideoFacts {
            file: String::new(),
            codec: String::new(),
            frames: None,
            bytes: None,
            blake3: None,
        },
        faults: Vec::new(),
        software: SoftwareFacts {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            commit: settings.commit.clone(),
        },
    }
}

fn facts_of(table: &Table, settings: &super::Settings) -> TurntableFacts {
    TurntableFacts {
        port: settings.turntable.to_string(),
        firmware: format!("Grbl {}", table.identity().firmware),
        degrees_per_second: settings.degrees_per_second,
        steps_per_degree: table.identity().steps_per_degree,
    }
}

/// Values as the manifest keeps them: a menu's as its words, a switch's as true or false.
fn controls_by_name(controls: &[Control]) -> BTreeMap<String, Value> {
    let named = controls.iter().filter_map(|control| {
        let value = control.value?;
        let kept = match &control.kind {
            ControlKind::Boolean => Value::from(value != 0),
            ControlKind::Menu(items) => items
                .iter()
                .find(|item| item.index == value)
                .map_or(Value::from(value), |item| Value::from(item.label.clone())),
            _ => Value::from(value),
        };
        Some((control.name.clone(), kept))
    });
    named.collect()
}

/// What is no longer as it was when the take began, a sentence each. A camera that does not answer
/// any more has its own fault, and is not asked twice.
fn moved_since(held: &Held, camera: &mut dyn Camera) -> Vec<String> {
    let Ok(now) = camera.controls() else {
        return Vec::new();
    };
    let mut moved = held.plan.check(&now);
    for other in moved_between(&held.controls, &now) {
        if moved.iter().all(|known| known.name != other.name) {
            moved.push(other);
        }
    }
    moved.iter().map(ToString::to_string).collect()
}

fn summary_of(report: &Report) -> TakeSummary {
    use super::state::Verdict;
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
