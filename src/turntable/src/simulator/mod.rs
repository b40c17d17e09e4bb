//! A turntable without hardware: the firmware's core, simulated over time.
//!
//! A [`SimulatedTable`] runs the same code as the chip, up to the present time of its [`Clock`]. Its
//! port works in memory; a [`Simulator`] provides it as a pseudoterminal for other programs. Both
//! behave like an Arduino's: opening the port resets the chip, bytes take as long as at 115 200 baud,
//! and faults of the line and the chip are injected on demand ([`TableFaults`]). Unlike a real table,
//! it also gives its true angle at any time.
//!
//! ```
//! use relit_data::clock::Clock;
//! use relit_turntable::simulator::{SimulatedTable, SimulatorOptions};
//! use relit_turntable::{TableOptions, Table};
//!
//! let clock = Clock::virtual_time();
//! let _participant = clock.participate();
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
//! # Ok::<(), relit_turntable::TurntableError>(())
//! ```
//!
//! This module knows the clock and the firmware's core, and of the host's side only the trait of a
//! port.

mod chip;
mod faults;
mod ground_truth;
mod model;
mod open_counter;
mod options;
mod serial_line;
mod simulated_table;
mod terminal;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use relit_data::clock::{Clock, JoinHandle};

pub use faults::{SerialFaults, TableFaults};
pub use ground_truth::{STEPS_PER_TURN, StepEdge};
pub use options::SimulatorOptions;
pub use simulated_table::{SimulatedPort, SimulatedTable};

use simulated_table::LOOK;
use terminal::Terminal;

/// A fault that is not understood, or a pseudoterminal, link or thread that could not be had: why, and what to do.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct SimulatorError(String);

/// A simulated table at a pseudoterminal, with a thread. Runs until it is dropped.
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
    /// [`SimulatorError`].
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
        simulator.thread = Some(thread.map_err(|error| {
            SimulatorError(format!(
                "could not start the simulated table's thread: {error}; end other programs and try again"
            ))
        })?);
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
}

impl Drop for Simulator {
    fn drop(&mut self) {
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

/// The thread: transfers bytes between table and pseudoterminal.
fn carry(clock: &Clock, table: &SimulatedTable, mut terminal: Terminal, stop: &AtomicBool) {
    const MAX_CHUNK: usize = 4096;
    let mut buffer = [0; MAX_CHUNK];
    while !stop.load(Ordering::Relaxed) {
        let now_us = clock.now_us();
        let mut model = table.model();
        for _ in 0..terminal.opened() {
            model.open(now_us);
        }
        let capacity = model.capacity().min(MAX_CHUNK);
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
    let failed = |error: std::io::Error| {
        SimulatorError(format!(
            "could not make {} a link to the simulated port: {error}; choose another name",
            link.display()
        ))
    };
    if fs::read_link(link).is_ok() {
        fs::remove_file(link).map_err(failed)?;
    }
    std::os::unix::fs::symlink(port, link).map_err(failed)
}
