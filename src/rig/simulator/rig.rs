//! The thread: keeps the chip's time at the clock's, and carries bytes between chip and port.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use rig_firmware::board::ResetCause;

use super::chip::{Chip, IndexPlace};
use super::terminal::Terminal;
use super::truth::{STEPS_PER_TURN, StepEdge};
use super::wire::{Timed, Wire};
use super::{Shared, SimulatorOptions, lock};
use crate::clock::Clock;

/// Ticks of the chip's timer in a microsecond.
const TICKS_PER_US: f64 = 2.0;
/// How often the thread looks, by its own clock, and never more often than this in real time.
const LOOK: Duration = Duration::from_micros(500);
const LEAST_SLEEP: Duration = Duration::from_micros(50);
/// Bytes that may be under way to the chip; a host that sends more waits, as at a real port.
const UNDERWAY: usize = 4096;

/// Chip ticks and microseconds of the clock.
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

/// What the thread works on.
pub(super) struct Rig {
    clock: Clock,
    timebase: Timebase,
    chip: Chip,
    terminal: Terminal,
    to_chip: Wire,
    from_chip: Wire,
    outbox: VecDeque<Timed>,
    reset_on_open: bool,
    /// When faults restart the chip, the next one last.
    resets: Vec<u64>,
    stall: Option<u64>,
    shared: Arc<Shared>,
}

impl Rig {
    pub(super) fn new(
        options: SimulatorOptions,
        terminal: Terminal,
        shared: Arc<Shared>,
        start_us: i64,
    ) -> Rig {
        let timebase = Timebase {
            start_us,
            ticks_per_us: TICKS_PER_US * (1.0 + options.drift_ppm / 1e6),
        };
        let steps = |degrees: f64| degrees / 360.0 * STEPS_PER_TURN;
        let index = IndexPlace {
            at: steps(options.index_at - options.start_angle),
            width: steps(options.index_width),
        };
        let at = |time: &Duration| timebase.ticks(start_us + time.as_micros() as i64);
        let mut resets: Vec<u64> = options.faults.resets.iter().map(at).collect();
        resets.sort_by(|one, other| other.cmp(one));
        let pins = *lock(&shared.pins);
        Rig {
            clock: options.clock,
            timebase,
            chip: Chip::new(pins, index),
            terminal,
            to_chip: Wire::new(options.faults.to_chip, options.seed, true),
            from_chip: Wire::new(options.faults.from_chip, options.seed, false),
            outbox: VecDeque::new(),
            reset_on_open: options.reset_on_open,
            resets,
            stall: options.faults.stall.as_ref().map(at),
            shared,
        }
    }

    /// Works until the handle says stop.
    pub(super) fn run(mut self) {
        let sleep = self.clock.real(LOOK).clamp(LEAST_SLEEP, LOOK);
        while !self.shared.stop.load(Ordering::Relaxed) {
            self.follow_clock();
            std::thread::sleep(sleep);
        }
    }

    fn follow_clock(&mut self) {
        let now = self.timebase.ticks(self.clock.now_us());
        self.listen(now);
        let pins = *lock(&self.shared.pins);
        self.chip.set_pins(pins);
        self.run_chip(now);
        self.speak(now);
        let timebase = self.timebase;
        let edges = self.chip.take_edges().map(|(at, steps)| StepEdge {
            t_us: timebase.us(at),
            steps,
        });
        lock(&self.shared.truth).extend(edges);
        let mut counts = lock(&self.shared.counts);
        counts.to_chip = self.to_chip.counts;
        counts.from_chip = self.from_chip.counts;
    }

    /// From the port to the chip.
    fn listen(&mut self, now: u64) {
        let opened = self.terminal.opened();
        if opened > 0 {
            lock(&self.shared.counts).opened += opened;
            if self.reset_on_open {
                self.chip.restart(ResetCause::External);
            }
        }
        if self.chip.inbox().len() > UNDERWAY {
            return;
        }
        let mut buffer = [0; UNDERWAY];
        for &byte in self.terminal.read(&mut buffer) {
            self.to_chip.carry(now, byte, self.chip.inbox());
        }
    }

    /// Lets the chip work up to now, with the faults that are due before.
    fn run_chip(&mut self, now: u64) {
        while let Some(at) = self.resets.pop_if(|at| *at <= now) {
            self.chip.run_until(at);
            self.chip.restart(ResetCause::Watchdog);
            lock(&self.shared.counts).resets += 1;
        }
        if let Some(at) = self.stall.take_if(|at| *at <= now) {
            self.chip.run_until(at);
            self.chip.stall();
            lock(&self.shared.counts).stalled = true;
        }
        self.chip.run_until(now);
    }

    /// From the chip to the port.
    fn speak(&mut self, now: u64) {
        for (at, byte) in self.chip.take_sent() {
            self.from_chip.carry(at, byte, &mut self.outbox);
        }
        let due = self.outbox.iter().take_while(|(at, _)| *at <= now).count();
        let bytes: Vec<u8> = self.outbox.drain(..due).map(|(_, byte)| byte).collect();
        self.terminal.write(&bytes);
    }
}
