//! What a rig's state is made of.

use std::fmt;

use serde::Serialize;

/// Where a capture stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Nothing is under way.
    #[default]
    Idle,
    /// Camera, table and disk are being checked and the camera's settings locked.
    Preflight,
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
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Idle => "ready",
            Self::Preflight => "checking camera, table and disk",
            Self::MovingBack => "moving back for the run-up",
            Self::Starting => "speeding up",
            Self::Recording => "recording",
            Self::Unwinding => "turning back",
            Self::Checking => "checking the take",
        })
    }
}

/// How a take came out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
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
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TakeSummary {
    /// The session's name.
    pub session: String,
    /// How it came out.
    pub verdict: Verdict,
    /// Frames on disk.
    pub frames: u64,
    /// Frames missing of the turn.
    pub dropped: u64,
    /// Whether it ended early because somebody stopped it, which is not a fault.
    pub is_stopped: bool,
    /// Why, in a sentence, where the verdict is not clean.
    pub reason: Option<String>,
    /// What else to know of the whole take, such as light that is too even, a sentence each.
    pub notes: Vec<String>,
}

/// The turntable as last heard.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct TableState {
    /// Whether there is a table at all.
    pub present: bool,
    /// Its state in Grbl's words, such as `Idle` or `Run`.
    pub state: String,
    /// Degrees from machine zero.
    pub angle_deg: Option<f64>,
    /// Degrees a second.
    pub degrees_per_second: Option<f64>,
    /// Its highest speed, degrees a second.
    pub max_degrees_per_second: Option<f64>,
    /// Whether it has an index sensor, by which it finds zero. Without one, zero is where a person sets it.
    pub has_index: bool,
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
    /// Why a take's turn has no room in the cable from where it stands, in a sentence; `None` if it has, or zero is not
    /// known.
    pub no_room: Option<String>,
    /// Volts of its battery, where it is measured.
    pub battery_v: Option<f64>,
    /// What is wrong with it, in a sentence.
    pub fault: Option<String>,
}

/// The camera as last seen.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
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
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FaultLine {
    /// Microseconds of the capture's clock.
    pub t_us: i64,
    /// What failed, on what, what to do.
    pub what: String,
}

/// Something that happened, with the time of day.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LogLine {
    /// When, RFC 3339, UTC.
    pub at: String,
    /// What.
    pub what: String,
}

/// How takes are captured, by the command line.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct CaptureSettings {
    /// The folder of sessions.
    pub root: String,
    /// The camera's address.
    pub camera: String,
    /// The turntable's address.
    pub turntable: String,
    /// Frame width and height that are requested, pixels; `null` for the largest.
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
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Check {
    /// What was checked.
    pub what: String,
    /// False where it is not as it should be, and the capture continues all the same.
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

impl TableState {
    /// Whether it moves, on whosever account.
    pub fn moves(&self) -> bool {
        ["Run", "Jog", "Home", "Hold"]
            .iter()
            .any(|word| self.state.starts_with(word))
    }
}
