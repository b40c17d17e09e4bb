//! The main loop's part of the firmware: protocol, states and plans.
//!
//! One line is under way at a time. What it has to wait for is its `Job`; until that is done,
//! further lines stay in the board's receive buffer, while real-time bytes, alarms, the lease and
//! the driver go on.

mod events;
mod lease;
mod lines;
mod motion;
mod status;

use crate::board::{Board, Events, ResetCause};
use crate::checked::Session;
use crate::gcode::Modal;
use crate::homing::HomingPhase;
use crate::line::LineReader;
use crate::ramp::Profile;
use crate::report;
use crate::settings::{GrblSettings, Key};
use crate::store::{Health, Store};

/// Why the table is locked: the numbers of `ALARM:N`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
enum Alarm {
    /// Not homed since the start; tells no number.
    Locked = 0,
    SoftLimit = 2,
    ResetInMotion = 3,
    ResetInHoming = 6,
    IndexStaysActive = 8,
    IndexNotFound = 9,
    Emergency = 10,
    LeaseExpired = 20,
}

impl Alarm {
    /// Whether the position is still right, so that a reset unlocks as well.
    fn keeps_position(self) -> bool {
        matches!(self, Alarm::SoftLimit | Alarm::LeaseExpired)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    Ready,
    Alarm(Alarm),
}

/// What happens once the table has ramped to a stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stop {
    /// The jog is dropped.
    Jog,
    /// The plan is dropped, and the table locked.
    Alarm(Alarm),
}

/// A way to go, waiting for a place in the queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Way {
    /// Thousandths of a degree from machine zero.
    target: i32,
    /// Thousandths of a degree/min.
    feed: u32,
    jog: bool,
}

/// What the line that is under way waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Job {
    /// No line is under way.
    None,
    Move(Way),
    /// Waits for rest, then for so many microseconds; `since`: counted up to here.
    Dwell {
        since: Option<u32>,
        left: u32,
    },
    Home(HomingPhase),
    /// The alarm that refuses the line.
    Refusal,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Driver {
    Off,
    /// Fed since this time, and not ready for steps yet.
    Waking(u32),
    /// At rest since this time, where it rests.
    On(Option<u32>),
}

/// Where the moves that are queued end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Planned {
    steps: i32,
    /// Thousandths of a degree, as requested: what relative moves count from.
    angle: i32,
}

/// The controller: call [`Controller::poll`] for ever.
///
/// Small fields come first: the chip's loads reach 64 bytes from a pointer, and each one further
/// costs three times the flash.
#[derive(Debug)]
#[repr(C)]
pub struct Controller {
    mode: Mode,
    job: Job,
    /// `!` was given, and `~` not yet.
    hold: bool,
    jogging: bool,
    stopping: Option<Stop>,
    /// The emergency stop was active, and no reset came since its release.
    emergency: bool,
    driver: Driver,
    /// Noted by interrupts and not followed yet.
    pending: Events,
    planned: Planned,
    modal: Modal,
    session: Session,
    /// The sequence number of the line that is under way.
    sequence: Option<u32>,
    /// When the host last sent something, or the table began to move.
    heard: u32,
    store: Store,
    profile: Profile,
    settings: GrblSettings,
    reader: LineReader,
}

impl Controller {
    /// Reads the settings and sends the banner.
    pub fn new<B: Board>(board: &mut B) -> Controller {
        let (store, settings, health) = Store::open(board);
        let mode = if settings.flag(Key::Homing) {
            Mode::Alarm(Alarm::Locked)
        } else {
            Mode::Ready
        };
        let mut controller = Controller {
            settings,
            profile: settings.profile(),
            store,
            modal: Modal::new(),
            reader: LineReader::new(),
            session: Session::Closed,
            pending: Events::NONE,
            mode,
            job: Job::None,
            sequence: None,
            planned: Planned { steps: 0, angle: 0 },
            hold: false,
            jogging: false,
            stopping: None,
            emergency: false,
            driver: Driver::Off,
            heard: board.micros(),
        };
        board.enable_driver(false);
        controller.apply_settings(board);
        if health == Health::Damaged {
            report::answer(board, false, None, crate::error::Error::Eeprom.code());
        }
        let cause = match board.reset_cause() {
            ResetCause::PowerOn => "power-on",
            ResetCause::External => "external",
            ResetCause::BrownOut => "brown-out",
            ResetCause::Watchdog => "watchdog",
        };
        controller.banner(board, cause);
        controller
    }

    /// One round of the main loop. Waits no longer than it takes to send what there is to say, or
    /// to write what changed into the EEPROM.
    pub fn poll<B: Board>(&mut self, board: &mut B) {
        board.pet_watchdog();
        self.pending.insert(board.take_events());
        self.follow_events(board);
        self.watch_lease(board);
        self.advance(board);
        self.drive(board);
        self.take_line(board);
    }

    /// Hands the settings to everything that works by them; at rest.
    fn apply_settings<B: Board>(&mut self, board: &mut B) {
        self.profile = self.settings.profile();
        board.configure_outputs(self.settings.outputs());
        let stepper_settings = self.settings.stepper(&self.profile);
        board.with_stepper(|stepper, _| stepper.configure(stepper_settings));
        self.plan_from_here(board);
    }

    /// Whether the table rests with nothing to do.
    fn is_idle<B: Board>(&self, board: &mut B) -> bool {
        let busy = board.with_stepper(|stepper, _| stepper.is_moving() || stepper.has_plan());
        let free = self.mode == Mode::Ready && self.job == Job::None && self.stopping.is_none();
        free && !busy && !self.hold
    }
}
