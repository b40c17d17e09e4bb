//! A turntable without hardware: the firmware's core, simulated over time.
//!
//! A [`SimulatedTable`] runs the same code as the chip, up to the present time of its [`Clock`]. Its
//! port works in memory; a [`Simulator`] provides it as a pseudoterminal for other programs. Both
//! behave like an Arduino's: opening the port resets the chip, bytes take as long as at 115 200 baud,
//! and faults of the wire and the chip are injected on demand ([`TableFaults`]). Unlike a real table,
//! it also gives its true angle at any time.
//!
//! ```
//! use relit_rig::clock::Clock;
//! use relit_rig::simulator::{SimulatedTable, SimulatorOptions};
//! use relit_rig::turntable::{TableOptions, Table};
//!
//! let clock = Clock::virtual_time();
//! let _participant = clock.take_part();
//! let simulated = SimulatedTable::new(&SimulatorOptions {
//!     clock: clock.clone(),
//!     ..SimulatorOptions::default()
//! });
//! let options = TableOptions {
//!     clock: clock.clone(),
//!     ..TableOptions::default()
//! };
//! let table = Table::open(simulated.open(), &options)?;
//! table.jog(90.0, None)?;
//! assert!((simulated.angle_at(clock.now_us()) - 90.0).abs() < 0.02);
//! # Ok::<(), relit_rig::turntable::TurntableError>(())
//! ```
//!
//! This module knows the clock and the firmware's core, and of the host's side only the trait of a
//! port.

mod chip;
mod faults;
mod model;
mod openings;
mod table;
mod terminal;
mod truth;
mod wire;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rustix::io::Errno;
use serde::Serialize;

use crate::clock::{Clock, JoinHandle};

pub use faults::{EmergencyStop, TableFaults, WireFaults};
pub use table::{SimulatedPort, SimulatedTable};
pub use truth::{STEPS_PER_TURN, StepEdge};
pub use wire::WireCounts;

use table::LOOK;
use terminal::Terminal;

/// An error of the simulator.
#[derive(Debug, thiserror::Error)]
pub enum SimulatorError {
    /// A fault that does not exist.
    #[error("the fault {item:?} is not understood: {why}")]
    Fault {
        /// The fault.
        item: String,
        /// What is wrong with it.
        why: &'static str,
    },
    /// A pseudoterminal could not be set up.
    #[error(
        "could not {step} a pseudoterminal: {errno}; see that /dev/pts is mounted and not full"
    )]
    Terminal {
        /// The step that failed.
        step: &'static str,
        /// The system's error.
        errno: Errno,
    },
    /// The link to the port could not be created.
    #[error("could not make {path} a link to the simulated port: {source}; choose another name")]
    Link {
        /// The link.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The thread could not be started.
    #[error("could not start the simulated table's thread: {0}; end other programs and try again")]
    Thread(io::Error),
}

/// Options of a simulated table.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatorOptions {
    /// Its clock. Everything that works with the table needs the same one.
    pub clock: Clock,
    /// The faults to inject.
    pub faults: TableFaults,
    /// Seed of the random faults.
    pub seed: u64,
    /// Angle at which the table stands at power-on, degrees.
    pub start_angle: f64,
    /// Angle at which the index becomes active in a positive turn, degrees.
    pub index_at: f64,
    /// Range in which the index stays active, degrees.
    pub index_width: f64,
    /// Battery voltage, volts.
    pub battery: f64,
    /// Deviation of the chip's crystal from the clock, parts per million; positive is faster.
    pub drift_ppm: f64,
    /// Whether opening the port resets the chip, as it does on an Arduino.
    pub reset_on_open: bool,
}

impl Default for SimulatorOptions {
    fn default() -> Self {
        SimulatorOptions {
            clock: Clock::monotonic(),
            faults: TableFaults::default(),
            seed: 0,
            start_angle: 0.0,
            index_at: 30.0,
            index_width: 4.0,
            battery: 12.0,
            drift_ppm: 0.0,
            reset_on_open: true,
        }
    }
}

/// Counters since power-on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct SimulatorCounts {
    /// On the way to the chip.
    pub to_chip: WireCounts,
    /// On the way from the chip.
    pub from_chip: WireCounts,
    /// How many times the port was opened.
    pub opened: u64,
    /// How many times a fault restarted the chip.
    pub resets: u64,
    /// Whether a fault stopped the chip.
    pub stalled: bool,
}

/// A simulated table at a pseudoterminal, with a thread. Runs until it is stopped or dropped.
///
/// Other programs cannot take part in virtual time: the clock has to be the monotonic one, or a
/// [paced](Clock::paced) one for a table that runs faster than real time.
pub struct Simulator {
    table: SimulatedTable,
    path: PathBuf,
    link: Option<PathBuf>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Simulator {
    /// Starts a table. `link`: path of a symbolic link to its port, to be created.
    ///
    /// # Errors
    /// [`SimulatorError::Terminal`], [`SimulatorError::Link`] or [`SimulatorError::Thread`].
    pub fn start(
        options: &SimulatorOptions,
        link: Option<&Path>,
    ) -> Result<Simulator, SimulatorError> {
        let terminal = Terminal::open()?;
        let path = terminal.path().to_owned();
        if let Some(link) = link {
            make_link(&path, link)?;
        }
        let mut simulator = Simulator {
            table: SimulatedTable::new(options),
            path,
            link: link.map(Path::to_owned),
            stop: Arc::default(),
            thread: None,
        };
        let (table, stop) = (simulator.table.clone(), Arc::clone(&simulator.stop));
        let clock = options.clock.clone();
        let thread = options.clock.spawn("simulator", move || {
            carry(&clock, &table, terminal, &stop);
        });
        simulator.thread = Some(thread.map_err(SimulatorError::Thread)?);
        Ok(simulator)
    }

    /// Path of the port that a host opens.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The table at the port.
    pub fn table(&self) -> &SimulatedTable {
        &self.table
    }

    /// Ends the thread; returns the counters.
    pub fn stop(mut self) -> SimulatorCounts {
        self.end();
        self.table.counts()
    }

    fn end(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A panic was already reported by the thread itself.
            let _ended = thread.join();
        }
        if let Some(link) = self.link.take()
            && fs::read_link(&link).is_ok_and(|target| target == self.path)
        {
            // If this fails, the next start replaces the link.
            let _removed = fs::remove_file(&link);
        }
    }
}

impl Drop for Simulator {
    fn drop(&mut self) {
        self.end();
    }
}

/// The thread: transfers bytes between table and pseudoterminal.
fn carry(clock: &Clock, table: &SimulatedTable, mut terminal: Terminal, stop: &AtomicBool) {
    const LARGEST: usize = 4096;
    let mut buffer = [0; LARGEST];
    while !stop.load(Ordering::Relaxed) {
        let now_us = clock.now_us();
        let mut model = table.model();
        for _ in 0..terminal.opened() {
            model.open(now_us);
        }
        let capacity = model.capacity().min(LARGEST);
        let received = terminal.read(buffer.get_mut(..capacity).unwrap_or_default());
        model.receive(now_us, received);
        let output = model.take_output(now_us, usize::MAX);
        drop(model);
        terminal.write(&output);
        clock.sleep(LOOK);
    }
}

/// Creates the link. A link that exists is replaced, any other file is not.
fn make_link(port: &Path, link: &Path) -> Result<(), SimulatorError> {
    let failed = |source| SimulatorError::Link {
        path: link.to_owned(),
        source,
    };
    if fs::read_link(link).is_ok() {
        fs::remove_file(link).map_err(failed)?;
    }
    std::os::unix::fs::symlink(port, link).map_err(failed)
}
