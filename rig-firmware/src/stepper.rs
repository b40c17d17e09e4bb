//! The step generator: called once a step by the timer's interrupt.

use crate::realtime::Realtime;

/// What the step timer's interrupt has to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fire {
    /// Send a step pulse now, in the direction that was set before.
    pub pulse: bool,
    /// Half microseconds until the next call; `None`: the timer rests until
    /// [`start_steps`](crate::board::Board::start_steps).
    pub next: Option<u32>,
    /// Set the direction pin for a positive turn (true) or a negative one before the next pulse.
    pub forward: bool,
}

/// The step generator.
#[derive(Debug)]
pub struct Stepper {
    position: i32,
    forward: bool,
}

impl Stepper {
    /// A generator at rest at position zero.
    pub const fn new() -> Stepper {
        Stepper {
            position: 0,
            forward: true,
        }
    }

    /// Makes one step, and says when the next is due. `index` is the raw level of the index pin.
    pub fn fire(&mut self, index: bool) -> Fire {
        let _ = index;
        Fire {
            pulse: false,
            next: None,
            forward: self.forward,
        }
    }

    /// Follows a real-time byte as far as steps are concerned; for the receive interrupt.
    pub fn obey(&mut self, realtime: Realtime) {
        match realtime {
            Realtime::Hold | Realtime::JogCancel => self.hold(),
            Realtime::Reset => self.halt(),
            Realtime::Status | Realtime::Resume | Realtime::Ignored => {}
        }
    }

    /// Tells the raw level of the emergency-stop input; for the interrupt of that pin. Steps stop
    /// at once if it is active. Returns whether it is active: then note
    /// [`Events::EMERGENCY`](crate::board::Events::EMERGENCY).
    pub fn emergency(&mut self, level: bool) -> bool {
        if level {
            self.halt();
        }
        level
    }

    /// Ramps to a stop, from the next step on.
    pub fn hold(&mut self) {}

    /// Stops at once and forgets the plan.
    pub fn halt(&mut self) {}

    /// The position in steps.
    pub fn position(&self) -> i32 {
        self.position
    }
}

impl Default for Stepper {
    fn default() -> Self {
        Stepper::new()
    }
}
