//! What the core needs of a chip.
//!
//! A board owns the [`Stepper`], because its step timer's interrupt calls [`Stepper::fire`], and
//! lends it to the main loop with that interrupt masked. Its receive interrupt sorts every byte
//! with [`classify`](crate::realtime::classify): real-time bytes go to [`Stepper::obey`] at once
//! and leave an [`Events`] bit; the others wait for [`Board::receive`]. The interrupt of the
//! emergency-stop input calls [`Stepper::emergency`].
//!
//! Knows the stepper and real-time bytes, and nothing of lines, settings or states.

use crate::realtime::Realtime;
use crate::stepper::Stepper;

/// A chip with a step timer, a serial line, a few pins and an EEPROM.
pub trait Board {
    /// Runs `f` with the step interrupt masked. The second argument is [`Board::micros`], latched
    /// under the same mask: it tells when the position that `f` reads was true.
    fn with_stepper<R>(&mut self, f: impl FnOnce(&mut Stepper, u32) -> R) -> R;

    /// Lets the step timer call [`Stepper::fire`] within a few microseconds if it rests; does
    /// nothing while it runs.
    fn start_steps(&mut self);

    /// Microseconds of the chip's clock; wraps after 71 minutes.
    fn micros(&mut self) -> u32;

    /// The next byte of a line, if one came.
    fn receive(&mut self) -> Option<u8>;

    /// How many more bytes the receive buffer takes.
    fn receive_room(&mut self) -> u8;

    /// What interrupts noted since the last call.
    fn take_events(&mut self) -> Events;

    /// Sends one byte; waits for room in the send buffer, at most a byte's time.
    fn send(&mut self, byte: u8);

    /// Feeds the motor driver, or releases it.
    fn enable_driver(&mut self, enabled: bool);

    /// How pulses and levels leave the chip: called at the start and when a setting changes.
    fn configure_outputs(&mut self, outputs: Outputs);

    /// The input pins as they are: true is closed, whatever the settings call active.
    fn inputs(&mut self) -> Inputs;

    /// The last conversion at the battery pin, 0..=1023.
    fn battery(&mut self) -> u16;

    /// Reads one byte of the EEPROM.
    fn eeprom_read(&mut self, address: u16) -> u8;

    /// Writes one byte of the EEPROM and waits for the end of it (some 3.4 ms).
    fn eeprom_write(&mut self, address: u16, byte: u8);

    /// Keeps the watchdog from resetting the chip.
    fn pet_watchdog(&mut self);

    /// Why the chip started.
    fn reset_cause(&mut self) -> ResetCause;
}

/// What interrupts noted: a set of the constants of this type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Events(u8);

impl Events {
    /// Nothing happened.
    pub const NONE: Events = Events(0);
    /// `?` came: a status report is due.
    pub const STATUS: Events = Events(1);
    /// `!` came.
    pub const HOLD: Events = Events(1 << 1);
    /// `~` came.
    pub const RESUME: Events = Events(1 << 2);
    /// 0x18 came.
    pub const RESET: Events = Events(1 << 3);
    /// 0x85 came.
    pub const JOG_CANCEL: Events = Events(1 << 4);
    /// The emergency-stop input was active.
    pub const EMERGENCY: Events = Events(1 << 5);
    /// A byte was lost: the receive buffer was full, or a byte was damaged on the line.
    pub const LOST_INPUT: Events = Events(1 << 6);
    /// Some byte came, of whatever kind.
    pub const RECEIVED: Events = Events(1 << 7);

    /// Adds the events of `other`.
    pub fn insert(&mut self, other: Events) {
        self.0 |= other.0;
    }

    /// Whether any event of `other` is among these.
    pub fn contains(self, other: Events) -> bool {
        self.0 & other.0 != 0
    }

    /// Takes the events of `other` out, and returns whether any was there.
    pub fn remove(&mut self, other: Events) -> bool {
        let there = self.contains(other);
        self.0 &= !other.0;
        there
    }

    /// Takes all events out and leaves none.
    pub fn take(&mut self) -> Events {
        core::mem::take(self)
    }
}

/// What a real-time byte leaves for the main loop.
impl From<Realtime> for Events {
    fn from(realtime: Realtime) -> Events {
        match realtime {
            Realtime::Status => Events::STATUS,
            Realtime::Hold => Events::HOLD,
            Realtime::Resume => Events::RESUME,
            Realtime::Reset => Events::RESET,
            Realtime::JogCancel => Events::JOG_CANCEL,
            Realtime::Ignored => Events::NONE,
        }
    }
}

/// The input pins, each with a pull-up: true is closed, that is pulled to ground by a switch or a
/// sensor; false is open.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Inputs {
    /// The index sensor.
    pub index: bool,
    /// The emergency stop.
    pub emergency_stop: bool,
}

/// How pulses and levels leave the chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outputs {
    /// Length of a step pulse in microseconds, 3..=100.
    pub pulse_us: u8,
    /// A step pulse is low instead of high.
    pub invert_step: bool,
    /// The direction pin is high for a positive turn instead of low.
    pub invert_direction: bool,
    /// The enable pin is high for a fed driver instead of low.
    pub invert_enable: bool,
}

/// Why the chip started.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResetCause {
    /// The supply came.
    PowerOn,
    /// The reset pin, as by a host that opens the port.
    External,
    /// The supply sagged.
    BrownOut,
    /// The program hung.
    Watchdog,
}
