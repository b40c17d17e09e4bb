//! A turntable without hardware: the firmware's core, as a function of time.
//!
//! A [`SimulatedTable`] runs the very code that runs on the chip, up to whatever its [`Clock`] shows
//! when somebody looks. Its port leads through memory; a [`Simulator`] puts it on a pseudoterminal, for
//! other programs. Either looks like an Arduino's: whoever opens it resets the chip, bytes take the
//! time of 115 200 baud, and the wire can be as bad as [`Faults`] asks. What no real table reports, this
//! one does: where it stood at any moment.
//!
//! ```
//! use relit_rig::clock::Clock;
//! use relit_rig::simulator::{SimulatedTable, SimulatorOptions};
//! use relit_rig::turntable::{Options, Table};
//!
//! let clock = Clock::virtual_time();
//! let _part = clock.take_part();
//! let simulated = SimulatedTable::new(&SimulatorOptions {
//!     clock: clock.clone(),
//!     ..SimulatorOptions::default()
//! });
//! let options = Options {
//!     clock: clock.clone(),
//!     ..Options::default()
//! };
//! let table = Table::open(simulated.open(), &options)?;
//! table.jog(90.0, None)?;
//! assert!((simulated.angle_at(clock.now_us()) - 90.0).abs() < 0.02);
//! # Ok::<(), relit_rig::turntable::TurntableError>(())
//! ```
//!
//! This module knows the clock, the firmware's core, and of the host's side only what a port is.

mod chip;
mod faults;
mod model;
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

pub use faults::{Faults, WireFaults};
pub use table::{SimulatedPort, SimulatedTable};
pub use truth::{STEPS_PER_TURN, StepEdge};
pub use wire::WireCounts;

use table::LOOK;
use terminal::Terminal;

/// Why there is no simulated table.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A fault that nobody can make.
    #[error("the fault {item:?} is not understood: {why}")]
    Fault {
        /// The fault.
        item: String,
        /// What is wrong with it.
        why: &'static str,
    },
    /// The system gave no pseudoterminal.
    #[error(
        "could not {step} a pseudoterminal: {errno}; see that /dev/pts is mounted and not full"
    )]
    Terminal {
        /// The step that failed.
        step: &'static str,
        /// What the system said.
        errno: Errno,
    },
    /// The link to the port could not be made.
    #[error("could not make {path} a link to the simulated port: {source}; choose another name")]
    Link {
        /// The link.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The system gave no thread.
    #[error("could not start the simulated table's thread: {0}; end other programs and try again")]
    Thread(io::Error),
}

/// How a simulated table is.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatorOptions {
    /// The clock that its time follows; give the same one to whatever works with it.
    pub clock: Clock,
    /// What goes wrong.
    pub faults: Faults,
    /// What makes random faults repeatable.
    pub seed: u64,
    /// The angle at which the table stands when it is switched on, degrees.
    pub start_angle: f64,
    /// The angle at which the index becomes active in a positive turn, degrees.
    pub index_at: f64,
    /// How far the index stays active, degrees.
    pub index_width: f64,
    /// Volts of the battery.
    pub battery: f64,
    /// How much faster than the clock the chip's crystal goes, parts in a million.
    pub drift_ppm: f64,
    /// Whether opening the port resets the chip, as with an Arduino.
    pub reset_on_open: bool,
}

impl Default for SimulatorOptions {
    fn default() -> Self {
        SimulatorOptions {
            clock: Clock::monotonic(),
            faults: Faults::default(),
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

/// What happened so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct SimulatorCounts {
    /// On the way to the chip.
    pub to_chip: WireCounts,
    /// On the way from the chip.
    pub from_chip: WireCounts,
    /// How often the port was opened.
    pub opened: u64,
    /// How often a fault restarted the chip.
    pub resets: u64,
    /// Whether a fault stopped the chip.
    pub stalled: bool,
}

/// A simulated table on a pseudoterminal, with a thread, until it is stopped or dropped.
///
/// Its time is the clock's, which other programs go by as well: the monotonic one, or a
/// [paced](Clock::paced) one for a table that runs faster than real time.
pub struct Simulator {
    table: SimulatedTable,
    path: PathBuf,
    link: Option<PathBuf>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Simulator {
    /// Switches a table on. `link` becomes a second name of its port.
    ///
    /// # Errors
    /// Where the system gives no pseudoterminal, link or thread.
    pub fn start(options: &SimulatorOptions, link: Option<&Path>) -> Result<Simulator, Error> {
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
        simulator.thread = Some(thread.map_err(Error::Thread)?);
        Ok(simulator)
    }

    /// The port that a host opens.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The table behind the port.
    pub fn table(&self) -> &SimulatedTable {
        &self.table
    }

    /// Switches the table off; gives what happened.
    pub fn stop(mut self) -> SimulatorCounts {
        self.end();
        self.table.counts()
    }

    fn end(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A panic in there was reported by the thread itself.
            let _ended = thread.join();
        }
        if let Some(link) = self.link.take()
            && fs::read_link(&link).is_ok_and(|target| target == self.path)
        {
            // A link that stays behind leads nowhere, and the next start replaces it.
            let _removed = fs::remove_file(&link);
        }
    }
}

impl Drop for Simulator {
    fn drop(&mut self) {
        self.end();
    }
}

/// The thread: carries bytes between table and pseudoterminal.
fn carry(clock: &Clock, table: &SimulatedTable, mut terminal: Terminal, stop: &AtomicBool) {
    const LARGEST: usize = 4096;
    let mut buffer = [0; LARGEST];
    while !stop.load(Ordering::Relaxed) {
        let now_us = clock.now_us();
        let mut model = table.model();
        for _ in 0..terminal.opened() {
            model.open(now_us);
        }
        let room = model.room().min(LARGEST);
        let heard = terminal.read(buffer.get_mut(..room).unwrap_or_default());
        model.hear(now_us, heard);
        let said = model.speak(now_us, usize::MAX);
        drop(model);
        terminal.write(&said);
        clock.sleep(LOOK);
    }
}

/// Makes the link; one that was left behind is replaced, anything else is not.
fn make_link(port: &Path, link: &Path) -> Result<(), Error> {
    let failed = |source| Error::Link {
        path: link.to_owned(),
        source,
    };
    if fs::read_link(link).is_ok() {
        fs::remove_file(link).map_err(failed)?;
    }
    std::os::unix::fs::symlink(port, link).map_err(failed)
}
