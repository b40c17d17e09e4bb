//! The chip: the firmware's core on simulated pins, timers and memory.
//!
//! Times are ticks of the step timer: half microseconds of the chip's crystal.

use std::collections::VecDeque;

use rig_firmware::board::{Board, Events, Inputs, Outputs, ResetCause};
use rig_firmware::controller::Controller;
use rig_firmware::realtime::{Received, classify};
use rig_firmware::stepper::Stepper;

use super::ground_truth::STEPS_PER_TURN;
use super::serial_line::{BYTE_TICKS, Timed};

const RECEIVE_BUFFER: usize = 128;
const SEND_BUFFER: usize = 64;
const EEPROM_BYTES: usize = 1024;
/// Time from a reset to the banner: the boot loader's.
const BOOT_TICKS: u64 = 600_000;
/// Duration of one iteration of the main loop.
const ROUND_TICKS: u64 = 400;
/// Time from arming the step timer to its first interrupt.
const ARM_TICKS: u64 = 10;
const EEPROM_WRITE_TICKS: u64 = 6800;

/// What determines the level of the index input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum IndexInput {
    ByAngle,
    Held(bool),
}

/// The chip's inputs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pins {
    pub(super) index: IndexInput,
    pub(super) emergency: bool,
    pub(super) battery: u16,
}

/// Where the index is active: motor steps from the position at power-on, within one turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct IndexPlace {
    pub(super) at: f64,
    pub(super) width: f64,
}

enum State {
    Booting { until: u64, cause: ResetCause },
    Running(Box<Controller>),
    Stalled,
}

/// The chip with its peripherals.
pub(super) struct Chip {
    bench: Bench,
    state: State,
}

impl Chip {
    pub(super) fn new(pins: Pins, index: IndexPlace) -> Chip {
        Chip {
            bench: Bench::new(pins, index),
            state: State::Booting {
                until: BOOT_TICKS,
                cause: ResetCause::PowerOn,
            },
        }
    }

    /// Restarts the program. The motor's position and the EEPROM are kept.
    pub(super) fn restart(&mut self, cause: ResetCause) {
        self.bench.restart();
        self.state = State::Booting {
            until: self.bench.now + BOOT_TICKS,
            cause,
        };
    }

    /// Stops the program for good.
    pub(super) fn stall(&mut self) {
        self.bench.restart();
        self.state = State::Stalled;
    }

    pub(super) fn set_pins(&mut self, pins: Pins) {
        let pressed = pins.emergency != self.bench.pins.emergency;
        self.bench.pins = pins;
        if pressed && self.bench.stepper.emergency(pins.emergency) {
            self.bench.events.insert(Events::EMERGENCY);
        }
    }

    /// Bytes in transit to the chip.
    pub(super) fn inbox(&mut self) -> &mut VecDeque<Timed> {
        &mut self.bench.inbox
    }

    /// Bytes that the chip has sent completely.
    pub(super) fn take_sent(&mut self) -> impl Iterator<Item = Timed> + '_ {
        let now = self.bench.now;
        let whole = self.bench.outbox.iter().take_while(|(at, _)| *at <= now);
        let count = whole.count();
        self.bench.outbox.drain(..count)
    }

    /// Steps since the last call: time and motor position of each.
    pub(super) fn take_edges(&mut self) -> impl Iterator<Item = (u64, i64)> + '_ {
        self.bench.edges.drain(..)
    }

    /// Runs the chip until a tick.
    pub(super) fn run_until(&mut self, end: u64) {
        while self.bench.now < end {
            match &mut self.state {
                State::Running(controller) => {
                    controller.poll(&mut self.bench);
                    self.bench.pass_until(self.bench.now + ROUND_TICKS);
                }
                State::Booting { until, cause } if *until <= self.bench.now => {
                    self.bench.cause = *cause;
                    self.state = State::Running(Box::new(Controller::new(&mut self.bench)));
                }
                State::Booting { until, .. } => {
                    let until = (*until).min(end);
                    self.bench.sleep_until(until);
                }
                State::Stalled => self.bench.sleep_until(end),
            }
        }
    }
}

/// The board on which the core runs.
struct Bench {
    now: u64,
    stepper: Stepper,
    /// When the step timer fires next.
    next_step: Option<u64>,
    forward: bool,
    /// Motor position, steps from the position at power-on.
    turned: i64,
    edges: Vec<(u64, i64)>,
    inbox: VecDeque<Timed>,
    received: VecDeque<u8>,
    outbox: VecDeque<Timed>,
    events: Events,
    pins: Pins,
    index: IndexPlace,
    eeprom: Vec<u8>,
    cause: ResetCause,
}

impl Bench {
    fn new(pins: Pins, index: IndexPlace) -> Bench {
        Bench {
            now: 0,
            stepper: Stepper::new(),
            next_step: None,
            forward: true,
            turned: 0,
            edges: Vec::new(),
            inbox: VecDeque::new(),
            received: VecDeque::new(),
            outbox: VecDeque::new(),
            events: Events::NONE,
            pins,
            index,
            eeprom: vec![0xFF; EEPROM_BYTES],
            cause: ResetCause::PowerOn,
        }
    }

    fn restart(&mut self) {
        self.stepper = Stepper::new();
        self.next_step = None;
        self.received.clear();
        self.events = Events::NONE;
    }

    fn index_level(&self) -> bool {
        match self.pins.index {
            IndexInput::Held(level) => level,
            IndexInput::ByAngle => {
                let past = (self.turned as f64 - self.index.at).rem_euclid(STEPS_PER_TURN);
                past < self.index.width
            }
        }
    }

    /// Lets time pass while the program runs, with the interrupts that occur.
    fn pass_until(&mut self, end: u64) {
        loop {
            let step = self.next_step.filter(|at| *at <= end);
            let byte = self
                .inbox
                .front()
                .map(|(at, _)| *at)
                .filter(|at| *at <= end);
            match (step, byte) {
                (Some(at), byte) if byte.is_none_or(|byte| at <= byte) => self.fire(at),
                (_, Some(at)) => {
                    self.now = self.now.max(at);
                    if let Some((_, byte)) = self.inbox.pop_front() {
                        self.receive_byte(byte);
                    }
                }
                _ => break,
            }
        }
        self.now = self.now.max(end);
    }

    /// Lets time pass while no program runs: received bytes are lost.
    fn sleep_until(&mut self, end: u64) {
        while self.inbox.front().is_some_and(|(at, _)| *at <= end) {
            self.inbox.pop_front();
        }
        self.now = self.now.max(end);
    }

    fn fire(&mut self, at: u64) {
        self.now = self.now.max(at);
        let forward = self.forward;
        let fire = self.stepper.fire(self.index_level());
        if fire.pulse {
            self.turned += if forward { 1 } else { -1 };
            self.edges.push((at, self.turned));
        }
        self.forward = fire.forward;
        self.next_step = fire.next.map(|ticks| at + u64::from(ticks));
    }

    fn receive_byte(&mut self, byte: u8) {
        self.events.insert(Events::RECEIVED);
        match classify(byte) {
            Received::Data(_) if self.received.len() >= RECEIVE_BUFFER => {
                self.events.insert(Events::LOST_INPUT);
            }
            Received::Data(byte) => self.received.push_back(byte),
            Received::Realtime(realtime) => {
                self.stepper.obey(realtime);
                self.stop_idle_timer();
                self.events.insert(Events::from(realtime));
            }
        }
    }

    /// Disarms the step timer after a halt.
    fn stop_idle_timer(&mut self) {
        if self.stepper.is_halted() {
            self.next_step = None;
        }
    }
}

impl Board for Bench {
    fn with_stepper<R>(&mut self, f: impl FnOnce(&mut Stepper, u32) -> R) -> R {
        let micros = self.micros();
        f(&mut self.stepper, micros)
    }

    fn start_steps(&mut self) {
        if self.next_step.is_none() {
            self.next_step = Some(self.now + ARM_TICKS);
        }
    }

    fn micros(&mut self) -> u32 {
        (self.now / 2) as u32
    }

    fn receive(&mut self) -> Option<u8> {
        self.received.pop_front()
    }

    fn receive_room(&mut self) -> u8 {
        RECEIVE_BUFFER.saturating_sub(self.received.len()) as u8
    }

    fn take_events(&mut self) -> Events {
        self.events.take()
    }

    fn send(&mut self, byte: u8) {
        let waiting = self.outbox.len().checked_sub(SEND_BUFFER);
        if let Some((at, _)) = waiting.and_then(|place| self.outbox.get(place)).copied() {
            self.pass_until(at);
        }
        let start = self.outbox.back().map_or(0, |(at, _)| *at).max(self.now);
        self.outbox.push_back((start + BYTE_TICKS, byte));
    }

    fn enable_driver(&mut self, _enabled: bool) {}

    fn configure_outputs(&mut self, _outputs: Outputs) {}

    fn inputs(&mut self) -> Inputs {
        Inputs {
            index: self.index_level(),
            emergency_stop: self.pins.emergency,
        }
    }

    fn battery(&mut self) -> u16 {
        self.pins.battery
    }

    fn eeprom_read(&mut self, address: u16) -> u8 {
        self.eeprom
            .get(usize::from(address))
            .copied()
            .unwrap_or(0xFF)
    }

    fn eeprom_write(&mut self, address: u16, byte: u8) {
        if let Some(place) = self.eeprom.get_mut(usize::from(address)) {
            *place = byte;
        }
        self.pass_until(self.now + EEPROM_WRITE_TICKS);
    }

    fn pet_watchdog(&mut self) {}

    fn reset_cause(&mut self) -> ResetCause {
        self.cause
    }
}
