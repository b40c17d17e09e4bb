//! The step generator: a queue of moves, turned into one interval after the other.
//!
//! The timer's interrupt calls [`Stepper::fire`] once a step, and every interval is computed there:
//! so a hold begins its ramp at the very next step, however much is queued. Speed is the ramp index
//! (see `ramp`), and looking ahead on one axis is linear in it: a move must be left
//! at an index from which what follows can still be stopped.
//!
//! Knows steps and ticks only; nothing of degrees, lines or states.

use crate::ramp::{Cruise, Ramp};
use crate::realtime::Realtime;
use crate::search::Search;

/// Moves that the queue holds.
pub const QUEUE: usize = 8;

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

/// A stretch in one direction at one speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Move {
    /// Steps that are not yet under way.
    pub steps: u32,
    /// The direction.
    pub forward: bool,
    /// The speed.
    pub cruise: Cruise,
}

/// Why a move was not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Full;

/// What the stepper has to know of the settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct StepperSettings {
    /// The first interval of a ramp, in 256ths of a tick.
    pub first_interval: u32,
    /// The index input is active when open.
    pub invert_index: bool,
    /// The emergency-stop input is active when open.
    pub invert_emergency: bool,
    /// Ticks for which the index has to stay before it counts.
    pub debounce: u32,
}

#[derive(Debug, Clone, Copy)]
struct Queued {
    plan: Move,
    /// The ramp index at which this move may be left.
    exit: u32,
}

const EMPTY: Queued = Queued {
    plan: Move {
        steps: 0,
        forward: false,
        cruise: Cruise {
            interval: 0,
            index: 0,
        },
    },
    exit: 0,
};

/// The step generator. The queue comes last: small fields are cheap to reach near the start.
#[derive(Debug)]
#[repr(C)]
pub struct Stepper {
    head: u8,
    length: u8,
    ramp: Ramp,
    position: i32,
    forward: bool,
    /// A step is under way: the next call sends its pulse.
    due: bool,
    /// The interval of the step under way, in 256ths of a tick.
    interval: u32,
    fraction: u8,
    held: bool,
    jogging: bool,
    halted: bool,
    halted_in_motion: bool,
    search: Search,
    settings: StepperSettings,
    queue: [Queued; QUEUE],
}

impl Stepper {
    /// A generator at rest at position zero, which waits for `Stepper::configure`. All of it is
    /// zero, so that it takes no flash.
    pub const fn new() -> Stepper {
        Stepper {
            queue: [EMPTY; QUEUE],
            head: 0,
            length: 0,
            ramp: Ramp::at_rest(0),
            position: 0,
            forward: false,
            due: false,
            interval: 0,
            fraction: 0,
            held: false,
            jogging: false,
            halted: false,
            halted_in_motion: false,
            search: Search::Off,
            settings: StepperSettings {
                first_interval: 0,
                invert_index: false,
                invert_emergency: false,
                debounce: 0,
            },
        }
    }

    /// Takes over settings. Only at rest: the ramp starts again.
    pub(crate) fn configure(&mut self, settings: StepperSettings) {
        self.settings = settings;
        self.ramp = Ramp::at_rest(settings.first_interval);
    }

    /// Makes one step, and says when the next is due. `index`: its input is
    /// closed (see [`Inputs`](crate::board::Inputs)).
    pub fn fire(&mut self, index: bool) -> Fire {
        let active = index != self.settings.invert_index;
        let ticks = self.interval >> 8;
        self.held |= self
            .search
            .look(active, self.position, ticks, self.settings.debounce);
        let pulse = core::mem::take(&mut self.due);
        if pulse {
            let step = if self.forward { 1 } else { -1 };
            self.position = self.position.wrapping_add(step);
        }
        let next = self.plan_step().map(|interval| {
            self.due = true;
            self.interval = interval;
            let parts = interval.saturating_add(u32::from(self.fraction));
            self.fraction = parts as u8;
            (parts >> 8).max(1)
        });
        Fire {
            pulse,
            next,
            forward: self.forward,
        }
    }

    /// Chooses the interval of the next step; `None` if none is to come.
    fn plan_step(&mut self) -> Option<u32> {
        if self.halted || (self.held && self.ramp.index() == 0) {
            return None;
        }
        let Some(head) = self.next_move() else {
            self.ramp.rest();
            return None;
        };
        head.plan.steps = head.plan.steps.saturating_sub(1);
        let (plan, room) = (head.plan, head.exit.saturating_add(head.plan.steps));
        self.forward = plan.forward;
        let index = self.ramp.index();
        Some(if self.held || index > room || index > plan.cruise.index {
            self.ramp.down()
        } else if index == plan.cruise.index {
            plan.cruise.interval
        } else if index < room {
            self.ramp.up()
        } else {
            self.ramp.interval().max(plan.cruise.interval)
        })
    }

    /// The move that the next step belongs to.
    fn next_move(&mut self) -> Option<&mut Queued> {
        while self.length > 0 && self.slot(0).is_none_or(|queued| queued.plan.steps == 0) {
            self.head = (self.head + 1) % QUEUE as u8;
            self.length -= 1;
        }
        if self.length == 0 {
            return None;
        }
        self.queue.get_mut(usize::from(self.head))
    }

    /// The queued move at a place counted from the head.
    fn slot(&self, place: u8) -> Option<&Queued> {
        let at = (usize::from(self.head) + usize::from(place)) % QUEUE;
        (place < self.length).then(|| self.queue.get(at)).flatten()
    }

    /// Adds a move to the queue and plans again.
    ///
    /// # Errors
    /// [`Full`] where the queue has no place, or after a halt that nobody cleared yet.
    pub(crate) fn push(&mut self, plan: Move) -> Result<(), Full> {
        if self.halted || usize::from(self.length) >= QUEUE {
            return Err(Full);
        }
        let at = (usize::from(self.head) + usize::from(self.length)) % QUEUE;
        if let Some(queued) = self.queue.get_mut(at) {
            *queued = Queued { plan, exit: 0 };
            self.length += 1;
        }
        self.plan_exits();
        Ok(())
    }

    /// From the last move back: the fastest exit from which all that follows can be stopped.
    fn plan_exits(&mut self) {
        let mut after: Option<Queued> = None;
        for place in (0..usize::from(self.length)).rev() {
            let at = (usize::from(self.head) + place) % QUEUE;
            let Some(queued) = self.queue.get_mut(at) else {
                continue;
            };
            queued.exit = match after {
                Some(next) if next.plan.forward == queued.plan.forward => {
                    let stoppable = next.exit.saturating_add(next.plan.steps);
                    let common = queued.plan.cruise.index.min(next.plan.cruise.index);
                    stoppable.min(common)
                }
                _ => 0,
            };
            after = Some(*queued);
        }
    }

    /// Places that are free in the queue.
    pub fn free(&self) -> u8 {
        let used = (0..self.length).filter(|&place| {
            self.slot(place)
                .is_some_and(|queued| queued.plan.steps > 0 || (place == 0 && self.due))
        });
        (QUEUE as u8).saturating_sub(used.count() as u8)
    }

    /// Follows a real-time byte as far as steps are concerned; for the receive interrupt.
    pub fn obey(&mut self, realtime: Realtime) {
        match realtime {
            Realtime::Hold => self.hold(),
            Realtime::JogCancel if self.jogging => self.hold(),
            Realtime::Reset => self.halt(),
            _ => {}
        }
    }

    /// Tells whether the emergency-stop input is closed; for the interrupt of that pin. Steps stop
    /// at once if it is active. Returns whether it is active: then note
    /// [`Events::EMERGENCY`](crate::board::Events::EMERGENCY).
    pub fn emergency(&mut self, closed: bool) -> bool {
        let active = closed != self.settings.invert_emergency;
        if active {
            self.halt();
        }
        active
    }

    /// Ramps to a stop, from the next step on; the plan stays.
    pub fn hold(&mut self) {
        self.held = true;
    }

    /// Ends a hold. Follow with [`start_steps`](crate::board::Board::start_steps).
    pub fn resume(&mut self) {
        self.held = false;
    }

    /// Stops at once and forgets the plan. Nothing moves until [`Stepper::clear_halt`].
    pub fn halt(&mut self) {
        self.halted_in_motion |= self.due;
        self.halted = true;
        self.due = false;
        self.search = Search::Off;
        self.ramp.rest();
        self.drop_plan();
    }

    /// Lets moves in again after a halt, and returns whether steps were under way when it came: then
    /// the motor may have gone on by itself.
    pub fn clear_halt(&mut self) -> bool {
        self.halted = false;
        core::mem::take(&mut self.halted_in_motion)
    }

    /// Whether a halt stands uncleared.
    pub fn is_halted(&self) -> bool {
        self.halted
    }

    /// Forgets what is queued, and a hold; at rest.
    pub fn drop_plan(&mut self) {
        self.length = 0;
        self.held = false;
        self.jogging = false;
    }

    /// Whether the moves in the queue are a jog, which 0x85 cancels.
    pub fn set_jogging(&mut self, jogging: bool) {
        self.jogging = jogging;
    }

    /// Whether a step is under way.
    pub fn is_moving(&self) -> bool {
        self.due
    }

    /// Whether steps are queued that no hold keeps back.
    pub fn has_steps(&self) -> bool {
        !self.held && self.has_plan()
    }

    /// Whether steps are queued.
    pub fn has_plan(&self) -> bool {
        (0..self.length).any(|place| self.slot(place).is_some_and(|queued| queued.plan.steps > 0))
    }

    /// The interval of the step under way in 256ths of a tick; `None` at rest.
    pub fn interval(&self) -> Option<u32> {
        self.due.then_some(self.interval)
    }

    /// The position in steps.
    pub fn position(&self) -> i32 {
        self.position
    }

    /// Calls the position `origin` zero from now on.
    pub fn move_origin(&mut self, origin: i32) {
        self.position = self.position.wrapping_sub(origin);
    }

    /// Looks for the index to become active (true) or inactive; the table ramps to a stop once it
    /// is found.
    pub fn search(&mut self, level: bool) {
        self.search = Search::For(level);
    }

    /// Whether a search has found what it looked for.
    pub fn has_found(&self) -> bool {
        matches!(self.search, Search::Found(_))
    }

    /// Ends a search: the position where the level came and stayed, if it did.
    pub fn end_search(&mut self) -> Option<i32> {
        match core::mem::replace(&mut self.search, Search::Off) {
            Search::Found(position) => Some(position),
            _ => None,
        }
    }
}
