//! The simulation of chip, serial line and motor, advanced to a given time on demand.

use std::cmp::Reverse;
use std::collections::VecDeque;
use std::time::Duration;

use rig_firmware::board::ResetCause;

use super::chip::{Chip, IndexPlace, Pins};
use super::faults::TableFaults;
use super::ground_truth::{GroundTruth, STEPS_PER_TURN, StepEdge};
use super::options::SimulatorOptions;
use super::serial_line::{SerialChannel, Timed};

/// Ticks of the chip's timer per microsecond.
const TICKS_PER_US: f64 = 2.0;
/// Largest number of bytes in transit to the chip.
const UNDERWAY: usize = 4096;

/// Converts between chip ticks and microseconds of the clock.
#[derive(Debug, Clone, Copy)]
struct Timebase {
    start_us: i64,
    ticks_per_us: f64,
}

impl Timebase {
    fn ticks(&self, us: i64) -> u64 {
        (us.saturating_sub(self.start_us) as f64 * self.ticks_per_us) as u64
    }

    fn us(&self, ticks: u64) -> i64 {
        self.start_us + (ticks as f64 / self.ticks_per_us).round() as i64
    }
}

/// What happens to the table by a fault.
#[derive(Debug, Clone, Copy)]
enum Event {
    Restart,
    Stall,
    /// The emergency stop is pressed.
    EmergencyStop,
}

/// A simulated table at some time. Every method that takes a time advances it to that time first.
pub(super) struct Model {
    timebase: Timebase,
    chip: Chip,
    pins: Pins,
    to_chip: SerialChannel,
    from_chip: SerialChannel,
    outbox: VecDeque<Timed>,
    reset_on_open: bool,
    /// What happens by itself, and when: the next one last.
    events: Vec<(u64, Event)>,
    ground_truth: GroundTruth,
}

impl Model {
    /// A table whose power comes on at `start_us`.
    pub(super) fn new(options: &SimulatorOptions, pins: Pins, start_us: i64) -> Model {
        let timebase = Timebase {
            start_us,
            ticks_per_us: TICKS_PER_US * (1.0 + options.drift_ppm / 1e6),
        };
        let steps = |degrees: f64| degrees / 360.0 * STEPS_PER_TURN;
        let index = IndexPlace {
            at: steps(options.index_at - options.start_angle),
            width: steps(options.index_width),
        };
        let at = |time: Duration| timebase.ticks(start_us + time.as_micros() as i64);
        let mut events: Vec<(u64, Event)> = events(&options.faults)
            .map(|(time, event)| (at(time), event))
            .collect();
        events.sort_by_key(|(at, _)| Reverse(*at));
        Model {
            timebase,
            chip: Chip::new(pins, index),
            pins,
            to_chip: SerialChannel::new(options.faults.to_chip, options.seed, true),
            from_chip: SerialChannel::new(options.faults.from_chip, options.seed, false),
            outbox: VecDeque::new(),
            reset_on_open: options.reset_on_open,
            events,
            ground_truth: GroundTruth::new(options.start_angle, start_us),
        }
    }

    /// Simulates the time until `now_us`.
    pub(super) fn advance(&mut self, now_us: i64) {
        let now = self.timebase.ticks(now_us);
        while let Some((at, event)) = self.events.pop_if(|(at, _)| *at <= now) {
            self.chip.run_until(at);
            self.happen(event);
        }
        self.chip.run_until(now);
        for (at, byte) in self.chip.take_sent() {
            self.from_chip.carry(at, byte, &mut self.outbox);
        }
        let timebase = self.timebase;
        let edges = self.chip.take_edges().map(|(at, steps)| StepEdge {
            t_us: timebase.us(at),
            steps,
        });
        self.ground_truth.extend(edges);
    }

    fn happen(&mut self, event: Event) {
        match event {
            Event::Restart => self.chip.restart(ResetCause::Watchdog),
            Event::Stall => self.chip.stall(),
            Event::EmergencyStop => {
                self.pins.emergency = true;
                self.chip.set_pins(self.pins);
            }
        }
    }

    /// A host opens the port.
    pub(super) fn open(&mut self, now_us: i64) {
        self.advance(now_us);
        if self.reset_on_open {
            self.chip.restart(ResetCause::External);
        }
    }

    /// How many bytes the line to the chip can take now.
    pub(super) fn capacity(&mut self) -> usize {
        UNDERWAY.saturating_sub(self.chip.inbox().len())
    }

    /// Takes bytes that the host sends now.
    pub(super) fn receive(&mut self, now_us: i64, bytes: &[u8]) {
        self.advance(now_us);
        let now = self.timebase.ticks(now_us);
        for &byte in bytes {
            self.to_chip.carry(now, byte, self.chip.inbox());
        }
    }

    /// The bytes that have arrived at the host, at most `limit`.
    pub(super) fn take_output(&mut self, now_us: i64, limit: usize) -> Vec<u8> {
        self.advance(now_us);
        let now = self.timebase.ticks(now_us);
        let due = self.outbox.iter().take_while(|(at, _)| *at <= now).count();
        let bytes = self.outbox.drain(..due.min(limit));
        bytes.map(|(_, byte)| byte).collect()
    }

    /// Changes the chip's input pins.
    pub(super) fn change_pins(&mut self, now_us: i64, change: impl FnOnce(&mut Pins)) {
        self.advance(now_us);
        change(&mut self.pins);
        self.chip.set_pins(self.pins);
    }

    pub(super) fn ground_truth(&self) -> &GroundTruth {
        &self.ground_truth
    }
}

/// The faults that happen at a time, counted from the start.
fn events(faults: &TableFaults) -> impl Iterator<Item = (Duration, Event)> {
    let restarts = faults.resets.iter().map(|at| (*at, Event::Restart));
    let stall = faults.stall.iter().map(|at| (*at, Event::Stall));
    let press = faults.emergency_stop.map(|at| (at, Event::EmergencyStop));
    restarts.chain(stall).chain(press)
}
