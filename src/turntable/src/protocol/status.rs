//! Status reports: `<Run|MPos:12.345,0.000,0.000|FS:432,0|T:123456789|Bat:11.84|Pn:X>`, and those of
//! Grbl's relatives: `<Alarm:11|MPos:0.000,0.000,0.000,0.000|Bf:35,1023|FS:0,0|Pn:X2|H:0|FW:grblHAL>`.

use std::fmt;

use super::number::{decimal, whole};

/// The controller's state, as Grbl names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ControllerState {
    /// At rest, ready.
    Idle,
    /// Executing G-code.
    Run,
    /// Feed hold, at rest (`Hold:0`), or what else waits for a person: an open door, a tool change, sleep.
    Held,
    /// Feed hold, still ramping down (`Hold:1`).
    Holding,
    /// Jogging.
    Jog,
    /// Searching for the index.
    Home,
    /// Locked after an alarm or at start-up.
    Alarm,
    /// Check mode: parses G-code without moving.
    Check,
    /// A state that this program does not know.
    Unknown,
}

impl ControllerState {
    /// Whether the table may be moving, or may start to move without a command.
    pub fn may_move(self) -> bool {
        matches!(
            self,
            ControllerState::Run
                | ControllerState::Holding
                | ControllerState::Jog
                | ControllerState::Home
        )
    }

    /// Reads a state's name; `sub` is the number after it. Grbl's relatives have sub-states and names
    /// of their own.
    fn from_name(name: &str, sub: Option<u32>) -> Option<ControllerState> {
        if !name.bytes().all(|byte| byte.is_ascii_alphabetic()) {
            return None;
        }
        Some(match (name, sub.unwrap_or(0)) {
            ("Idle", _) => ControllerState::Idle,
            ("Run", _) => ControllerState::Run,
            ("Hold", 0) | ("Door", 0 | 1) | ("Sleep" | "Tool", _) => ControllerState::Held,
            ("Hold" | "Door", _) => ControllerState::Holding,
            ("Jog", _) => ControllerState::Jog,
            ("Home", _) => ControllerState::Home,
            ("Alarm", _) => ControllerState::Alarm,
            ("Check", _) => ControllerState::Check,
            _ => ControllerState::Unknown,
        })
    }
}

impl fmt::Display for ControllerState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ControllerState::Idle => "Idle",
            ControllerState::Run => "Run",
            ControllerState::Held => "Hold:0",
            ControllerState::Holding => "Hold:1",
            ControllerState::Jog => "Jog",
            ControllerState::Home => "Home",
            ControllerState::Alarm => "Alarm",
            ControllerState::Check => "Check",
            ControllerState::Unknown => "Unknown",
        })
    }
}

/// Input pins that are active.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pins {
    /// The index sensor (Grbl's limit switch of X).
    pub index: bool,
    /// The emergency stop (Grbl's reset pin, or the emergency stop of grblHAL and FluidNC).
    pub emergency_stop: bool,
}

impl Pins {
    /// Reads the letters of the active pins. Other letters and digits are other inputs.
    fn from_letters(letters: &str) -> Pins {
        Pins {
            index: letters.contains('X'),
            emergency_stop: letters.contains(['R', 'E']),
        }
    }
}

/// A status report, with the times of its request and its arrival. What is not known in it is skipped, as Grbl's
/// documentation demands; a damaged position or speed makes the whole report noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StatusReport {
    /// The controller's state.
    pub state: ControllerState,
    /// The alarm's number, where the state comes with it (`Alarm:11`).
    pub alarm: Option<u8>,
    /// The table's position from machine zero, degrees.
    pub machine_deg: f64,
    /// Speed, the controller's unit per minute.
    pub feed: Option<f64>,
    /// Microseconds of the chip's clock at the moment of the position; wraps. Only the rig's firmware
    /// means that by `T:`: to grblHAL it is a tool's number.
    pub chip_us: Option<u32>,
    /// Battery, volts.
    pub battery_v: Option<f64>,
    /// Active pins.
    pub pins: Pins,
    /// Whether the controller counts itself as homed (grblHAL's `H:`).
    pub homed: Option<bool>,
    /// When it was requested, microseconds; `None` for a report without request.
    pub asked_us: Option<i64>,
    /// When its first byte arrived, microseconds.
    pub came_us: i64,
    /// Whether it certainly answers that request and no earlier one.
    pub certain: bool,
}

impl StatusReport {
    /// Reads a report, whose times are not known yet.
    pub(super) fn parse(line: &str) -> Option<StatusReport> {
        let inside = line.strip_prefix('<')?.strip_suffix('>')?;
        if inside.contains(['<', '>']) {
            return None;
        }
        let mut fields = inside.split('|');
        let state = fields.next()?;
        let (name, sub) = state.split_once(':').unwrap_or((state, ""));
        let sub = whole(sub);
        let state = ControllerState::from_name(name, sub)?;
        let alarm = sub.filter(|_| state == ControllerState::Alarm);
        let mut report = StatusReport {
            state,
            alarm: alarm.and_then(|code| u8::try_from(code).ok()),
            machine_deg: 0.0,
            feed: None,
            chip_us: None,
            battery_v: None,
            pins: Pins::default(),
            homed: None,
            asked_us: None,
            came_us: 0,
            certain: false,
        };
        let mut position = None;
        for (name, value) in fields.filter_map(|field| field.split_once(':')) {
            // One that decides where the table is must be neither damaged nor repeated.
            match name {
                "MPos" => once(&mut position, first(value)?)?,
                "FS" | "F" => once(&mut report.feed, first(value)?)?,
                "T" => report.chip_us = whole(value),
                "Bat" => report.battery_v = decimal(value),
                "Pn" => report.pins = Pins::from_letters(value),
                "H" => report.homed = homed(value),
                _ => {}
            }
        }
        report.machine_deg = position?;
        Some(report)
    }

    /// Whether the next report agrees with this one. In motion, positions differ.
    pub(crate) fn confirms(&self, next: &StatusReport) -> bool {
        let same = self.machine_deg == next.machine_deg || next.state.may_move();
        self.state == next.state && self.alarm == next.alarm && same
    }
}

/// grblHAL's `1` or `0`, perhaps with the homed axes after it.
fn homed(value: &str) -> Option<bool> {
    match value.split(',').next()? {
        "1" => Some(true),
        "0" => Some(false),
        _ => None,
    }
}

fn once<T>(place: &mut Option<T>, value: T) -> Option<()> {
    place.replace(value).is_none().then_some(())
}

/// The first number of a list, one for each axis; `None` if one of them is not a number.
fn first(list: &str) -> Option<f64> {
    let mut numbers = list.split(',').map(decimal);
    let first = numbers.next()??;
    numbers.all(|number| number.is_some()).then_some(first)
}
