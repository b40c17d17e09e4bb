//! Status reports: `<Run|MPos:12.345,0.000,0.000|FS:432,0|T:123456789|Bat:11.84|Pn:X>`.

use std::fmt;

use super::number::{decimal, shown, whole};

/// The controller's state, as Grbl names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ControllerState {
    /// At rest, ready.
    Idle,
    /// Executing G-code.
    Run,
    /// Feed hold, at rest (`Hold:0`).
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
    /// The safety door is open. A table has none, but a stock board can report it.
    Door,
    /// Asleep until a reset.
    Sleep,
}

impl ControllerState {
    /// Whether the table may be moving, or may start to move without a command.
    #[must_use]
    pub fn may_move(self) -> bool {
        matches!(
            self,
            ControllerState::Run
                | ControllerState::Holding
                | ControllerState::Jog
                | ControllerState::Home
                | ControllerState::Door
        )
    }

    fn parse(text: &str) -> Option<ControllerState> {
        let (name, sub) = match text.split_once(':') {
            Some((name, sub)) => (name, Some(whole(sub)?)),
            None => (text, None),
        };
        Some(match (name, sub) {
            ("Idle", None) => ControllerState::Idle,
            ("Run", None) => ControllerState::Run,
            ("Hold", Some(0)) => ControllerState::Held,
            ("Hold", Some(1)) => ControllerState::Holding,
            ("Jog", None) => ControllerState::Jog,
            ("Home", None) => ControllerState::Home,
            ("Alarm", None) => ControllerState::Alarm,
            ("Check", None) => ControllerState::Check,
            ("Door", Some(0..=3)) => ControllerState::Door,
            ("Sleep", None) => ControllerState::Sleep,
            _ => return None,
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
            ControllerState::Door => "Door:0",
            ControllerState::Sleep => "Sleep",
        })
    }
}

/// A position in the controller's unit, in either of Grbl's two forms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Position {
    /// From machine zero.
    Machine(f64),
    /// From the zero of the work coordinates.
    Work(f64),
}

/// Input pins that are active.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pins {
    /// The index sensor (Grbl's limit switch of X).
    pub index: bool,
    /// The emergency stop (Grbl's reset pin).
    pub emergency_stop: bool,
}

/// A status report. Unknown fields are skipped, as Grbl's documentation demands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StatusReport {
    /// The controller's state.
    pub state: ControllerState,
    /// The table's position.
    pub position: Position,
    /// Speed, the controller's unit per minute.
    pub feed: Option<f64>,
    /// Microseconds of the chip's clock at the moment of the position; wraps.
    pub chip_us: Option<u32>,
    /// Battery, volts.
    pub battery_v: Option<f64>,
    /// Active pins.
    pub pins: Pins,
    /// Machine position of the work coordinates' zero.
    pub work_zero: Option<f64>,
}

impl StatusReport {
    pub(super) fn parse(line: &str) -> Option<StatusReport> {
        let inside = line.strip_prefix('<')?.strip_suffix('>')?;
        if inside.contains(['<', '>']) {
            return None;
        }
        let mut fields = inside.split('|');
        let state = ControllerState::parse(fields.next()?)?;
        let mut read = Fields::default();
        for field in fields {
            let (name, value) = field.split_once(':')?;
            read.take(name, value)?;
        }
        Some(StatusReport {
            state,
            position: read.position?,
            feed: read.feed,
            chip_us: read.chip_us,
            battery_v: read.battery_v,
            pins: read.pins,
            work_zero: read.work_zero,
        })
    }
}

#[derive(Default)]
struct Fields {
    position: Option<Position>,
    feed: Option<f64>,
    chip_us: Option<u32>,
    battery_v: Option<f64>,
    pins: Pins,
    work_zero: Option<f64>,
}

impl Fields {
    /// Reads a field; `None` if a known one is damaged or repeated.
    fn take(&mut self, name: &str, value: &str) -> Option<()> {
        match name {
            "MPos" => once(&mut self.position, Position::Machine(first(value)?)),
            "WPos" => once(&mut self.position, Position::Work(first(value)?)),
            "FS" | "F" => once(&mut self.feed, first(value)?),
            "T" => once(&mut self.chip_us, whole(value)?),
            "Bat" => once(&mut self.battery_v, decimal(value)?),
            "WCO" => once(&mut self.work_zero, first(value)?),
            "Pn" => {
                self.pins = Pins {
                    index: value.contains('X'),
                    emergency_stop: value.contains('R'),
                };
                value.bytes().all(|b| b.is_ascii_uppercase()).then_some(())
            }
            _ => Some(()),
        }
    }
}

fn once<T>(place: &mut Option<T>, value: T) -> Option<()> {
    place.replace(value).is_none().then_some(())
}

/// The first number of a list; `None` if one of them is not a number.
fn first(list: &str) -> Option<f64> {
    let mut numbers = list.split(',').map(decimal);
    let first = numbers.next()??;
    numbers.all(|number| number.is_some()).then_some(first)
}

impl fmt::Display for StatusReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "<{}", self.state)?;
        match self.position {
            Position::Machine(at) => write!(f, "|MPos:{},0.000,0.000", shown(at, 3))?,
            Position::Work(at) => write!(f, "|WPos:{},0.000,0.000", shown(at, 3))?,
        }
        if let Some(feed) = self.feed {
            write!(f, "|FS:{feed},0")?;
        }
        if let Some(us) = self.chip_us {
            write!(f, "|T:{us}")?;
        }
        if let Some(volts) = self.battery_v {
            write!(f, "|Bat:{}", shown(volts, 2))?;
        }
        match (self.pins.index, self.pins.emergency_stop) {
            (false, false) => {}
            (true, false) => f.write_str("|Pn:X")?,
            (false, true) => f.write_str("|Pn:R")?,
            (true, true) => f.write_str("|Pn:XR")?,
        }
        if let Some(zero) = self.work_zero {
            write!(f, "|WCO:{},0.000,0.000", shown(zero, 3))?;
        }
        f.write_str(">")
    }
}
