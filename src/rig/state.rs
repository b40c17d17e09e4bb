//! What the rig is doing, as everybody beside it sees it: terminal, page, metrics.
//!
//! One [`Monitor`] a rig. The capture writes into it, any number of viewers read or subscribe; none of
//! them can hold the capture up. This module knows no other module.

use std::collections::VecDeque;
use std::fmt;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use jiff::Timestamp;
use serde::Serialize;
use tokio::sync::watch;
use utoipa::ToSchema;

/// Faults kept for display; older ones are in the sessions' manifests.
const FAULTS_KEPT: usize = 50;

/// Lines of the log kept for display.
const LOG_KEPT: usize = 40;

/// Where a capture stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Default, ToSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Nothing is under way.
    #[default]
    Idle,
    /// Camera, table and disk are being checked and the camera's settings locked.
    Preflight,
    /// A slow turn that finds the exposure.
    Metering,
    /// The table goes back by its ramp.
    MovingBack,
    /// The table gathers speed.
    Starting,
    /// The frames of the turn are being written.
    Recording,
    /// The table slows down and goes back to where it began.
    Unwinding,
    /// The take is being checked and the session closed.
    Checking,
    /// A queue of objects waits for somebody to say that the next one stands on the table.
    WaitingForObject,
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Idle => "waiting",
            Self::WaitingForObject => "waiting for the next object",
            Self::Preflight => "checking camera, table and disk",
            Self::Metering => "metering: the table turns slowly",
            Self::MovingBack => "the table goes back by its ramp",
            Self::Starting => "the table gathers speed",
            Self::Recording => "recording",
            Self::Unwinding => "the table goes back to where it began",
            Self::Checking => "checking the take",
        })
    }
}

/// How a take came out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// All frames of the turn, nothing moved.
    Clean,
    /// Frames were dropped, no more than allowed.
    Tolerated,
    /// Kept, marked as aborted.
    Aborted,
}

/// The last take, or the one before the present one.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct TakeSummary {
    /// The session's name.
    pub session: String,
    /// How it came out.
    pub verdict: Verdict,
    /// Frames on disk.
    pub frames: u64,
    /// Frames missing of the turn.
    pub dropped: u64,
    /// Why, in a sentence, where the verdict is not clean.
    pub reason: Option<String>,
}

/// The turntable as last heard.
#[derive(Debug, Clone, PartialEq, Serialize, Default, ToSchema)]
#[non_exhaustive]
pub struct TableState {
    /// Whether there is a table at all.
    pub present: bool,
    /// Its state in Grbl's words, such as `Idle` or `Run`.
    pub state: String,
    /// Degrees from machine zero.
    pub angle_deg: Option<f64>,
    /// Degrees a second.
    pub degrees_per_second: Option<f64>,
    /// Whether zero is known.
    pub homed: bool,
    /// Whether the emergency stop is pressed.
    pub emergency_stop: bool,
    /// Whether an alarm has locked it: the command `reset` resets, unlocks and homes it.
    pub locked: bool,
    /// How far it may turn back, degrees from the angle 0, where its cable hangs free.
    pub low_deg: Option<f64>,
    /// How far it may turn on, degrees from the angle 0.
    pub high_deg: Option<f64>,
    /// Volts of its battery, where it is measured.
    pub battery_v: Option<f64>,
    /// What is wrong with it, in a sentence.
    pub fault: Option<String>,
}

/// The camera as last seen.
#[derive(Debug, Clone, PartialEq, Serialize, Default, ToSchema)]
#[non_exhaustive]
pub struct CameraState {
    /// Whether it can be reached.
    pub present: bool,
    /// Its name.
    pub name: String,
    /// Four-character code, width, height and frames a second as granted, such as `MJPG 1920x1080 30/s`.
    pub mode: String,
    /// Frames a second as measured over the last second.
    pub fps: Option<f64>,
    /// Exposure, gain, white balance, focus and power-line filter as read back.
    pub controls: Vec<(String, i64)>,
    /// Pixels of the newest frame with all channels saturated, as a fraction 0 to 1.
    pub clipped: Option<f64>,
    /// Variance of the Laplacian of luma in the middle of the newest frame: greater is sharper.
    pub focus: Option<f64>,
    /// What is wrong with it, in a sentence.
    pub fault: Option<String>,
}

/// Something that went wrong, in plain words.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[non_exhaustive]
pub struct FaultLine {
    /// Microseconds of the capture's clock.
    pub t_us: i64,
    /// What failed, on what, what to do.
    pub what: String,
}

/// Something that happened, with the time of day.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, ToSchema)]
#[non_exhaustive]
pub struct LogLine {
    /// When, RFC 3339, UTC.
    pub at: String,
    /// What.
    pub what: String,
}

/// How takes are captured. All but the addresses can be changed by the command `configure`.
#[derive(Debug, Clone, PartialEq, Serialize, Default, ToSchema)]
pub struct CaptureSettings {
    /// The folder of sessions.
    pub root: String,
    /// The camera's address.
    pub camera: String,
    /// The turntable's address.
    pub turntable: String,
    /// Frame width and height that are asked for, pixels; `null` takes the largest.
    pub size: Option<(u32, u32)>,
    /// Frames a second.
    pub fps: f64,
    /// Speed of the turn, degrees a second.
    pub degrees_per_second: f64,
    /// Frames that may be missing or damaged.
    pub max_dropped: u64,
    /// How often a take that is not usable is repeated.
    pub retries: u32,
}

/// Something that was checked before the table turned.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, ToSchema)]
pub struct Check {
    /// What was checked.
    pub what: String,
    /// False where it is not as it should be, and the capture goes on all the same.
    pub good: bool,
    /// What was found.
    pub found: String,
}

impl Check {
    /// A check that was passed.
    pub fn passed(what: impl Into<String>, found: impl Into<String>) -> Self {
        Self {
            what: what.into(),
            good: true,
            found: found.into(),
        }
    }

    /// Something that the person at the rig has to know, and that keeps nobody from going on.
    pub fn noted(what: impl Into<String>, found: impl Into<String>) -> Self {
        Self {
            good: false,
            ..Self::passed(what, found)
        }
    }
}

/// All that a viewer may know.
#[derive(Debug, Clone, PartialEq, Serialize, Default, ToSchema)]
#[non_exhaustive]
pub struct RigState {
    /// Counts changes: a viewer that has seen this number has seen this state.
    pub version: u64,
    /// Where the capture stands.
    pub phase: Phase,
    /// The object on the table.
    pub object: Option<String>,
    /// Objects that wait for their turn.
    pub queue: Vec<String>,
    /// The session being written.
    pub session: Option<String>,
    /// Frames written of the present take.
    pub frames: u64,
    /// Frames the present take shall have.
    pub frames_wanted: u64,
    /// Frames found missing so far.
    pub dropped: u64,
    /// The table.
    pub table: TableState,
    /// The camera.
    pub camera: CameraState,
    /// Bytes free where sessions are written.
    pub free_bytes: u64,
    /// Bytes that a take is expected to need.
    pub needed_bytes: u64,
    /// What the last preflight found.
    pub checks: Vec<Check>,
    /// Newest last.
    #[schema(value_type = Vec<FaultLine>)]
    pub faults: VecDeque<FaultLine>,
    /// The last finished take.
    pub last_take: Option<TakeSummary>,
    /// How takes are captured.
    pub settings: CaptureSettings,
    /// What happened last, newest last.
    #[schema(value_type = Vec<LogLine>)]
    pub log: VecDeque<LogLine>,
}

impl RigState {
    /// Adds a line to the log that is shown.
    pub fn note(&mut self, what: impl Into<String>) {
        let what = what.into();
        if self.log.len() == LOG_KEPT {
            self.log.pop_front();
        }
        let at = Timestamp::now().strftime("%Y-%m-%dT%H:%M:%SZ").to_string();
        self.log.push_back(LogLine { at, what });
    }
}

/// A picture for viewers.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PreviewFrame {
    /// Counts frames, so that a viewer knows a new one.
    pub number: u64,
    /// Microseconds of the capture's clock.
    pub t_us: i64,
    /// A whole JPEG file.
    pub jpeg: Arc<[u8]>,
}

/// The rig's state and newest picture, shared between one capture and its viewers.
#[derive(Debug, Clone, Default)]
pub struct Monitor {
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<RigState>,
    changed: Condvar,
    version: watch::Sender<u64>,
    picture: watch::Sender<Option<PreviewFrame>>,
}

impl Monitor {
    /// The state now.
    pub fn state(&self) -> RigState {
        lock(&self.shared.state).clone()
    }

    /// Changes the state and wakes those who wait for a change.
    pub fn update(&self, change: impl FnOnce(&mut RigState)) {
        let mut state = lock(&self.shared.state);
        let before = state.phase;
        change(&mut state);
        if state.phase != before {
            let phase = state.phase.to_string();
            state.note(phase);
        }
        state.version = state.version.wrapping_add(1);
        self.shared.changed.notify_all();
        self.shared.version.send_replace(state.version);
    }

    /// Adds a fault to the list that is shown.
    pub fn fault(&self, t_us: i64, what: impl Into<String>) {
        let line = FaultLine {
            t_us,
            what: what.into(),
        };
        self.update(|state| {
            if state.faults.len() == FAULTS_KEPT {
                state.faults.pop_front();
            }
            state.note(line.what.clone());
            state.faults.push_back(line);
        });
    }

    /// The state once it is newer than `seen`, or as it is after `timeout`.
    pub fn wait_newer(&self, seen: u64, timeout: Duration) -> RigState {
        let state = lock(&self.shared.state);
        let (state, _) = self
            .shared
            .changed
            .wait_timeout_while(state, timeout, |state| state.version == seen)
            .unwrap_or_else(PoisonError::into_inner);
        state.clone()
    }

    /// The versions of the state as they come; who falls behind skips some.
    pub fn versions(&self) -> watch::Receiver<u64> {
        self.shared.version.subscribe()
    }

    /// Shows a picture; the one before is forgotten.
    pub fn show(&self, t_us: i64, jpeg: Arc<[u8]>) {
        self.shared.picture.send_modify(|picture| {
            let number = picture.as_ref().map_or(0, |last| last.number) + 1;
            *picture = Some(PreviewFrame { number, t_us, jpeg });
        });
    }

    /// The newest picture.
    pub fn preview(&self) -> Option<PreviewFrame> {
        self.shared.picture.borrow().clone()
    }

    /// The newest picture, again and again; who falls behind skips some.
    pub fn pictures(&self) -> watch::Receiver<Option<PreviewFrame>> {
        self.shared.picture.subscribe()
    }

    /// Whether anybody is waiting for pictures.
    pub fn is_watched(&self) -> bool {
        self.shared.picture.receiver_count() > 0
    }
}

/// A viewer that panicked left the value whole: every change is made under one lock.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
