//! A turntable without hardware: the firmware's core on a pseudoterminal.
//!
//! A thread lets the very code that runs on the chip work in virtual time, which follows a
//! [`Clock`]: in real time, or faster. The port looks like an Arduino's: whoever opens it resets
//! the chip, bytes take the time of 115 200 baud, and the wire can be as bad as [`Faults`] asks.
//! What no real table tells, this one does: where it stood at any moment.
//!
//! Knows the clock and the firmware's core; nothing of the host's side of the line.

mod chip;
mod faults;
mod rig;
mod terminal;
mod truth;
mod wire;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use rustix::io::Errno;
use serde::Serialize;

use crate::clock::Clock;

pub use faults::{Faults, WireFaults};
pub use truth::{STEPS_PER_TURN, StepEdge};
pub use wire::WireCounts;

use chip::{IndexInput, Pins};
use rig::Rig;
use terminal::Terminal;
use truth::Truth;

/// Volts at the battery input's full scale.
const BATTERY_SCALE: f64 = 15.5;
/// The converter's highest value.
const BATTERY_FULL: f64 = 1023.0;

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
    /// A second name for the port.
    pub link: Option<PathBuf>,
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
            link: None,
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

/// What the thread and the handle share.
struct Shared {
    stop: AtomicBool,
    pins: Mutex<Pins>,
    truth: Mutex<Truth>,
    counts: Mutex<SimulatorCounts>,
}

/// A simulated table that runs until it is stopped or dropped.
pub struct Simulator {
    path: PathBuf,
    link: Option<PathBuf>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Simulator {
    /// Switches a table on.
    ///
    /// # Errors
    /// Where the system gives no pseudoterminal, link or thread.
    pub fn start(options: SimulatorOptions) -> Result<Simulator, Error> {
        let terminal = Terminal::open()?;
        let path = terminal.path().to_owned();
        if let Some(link) = &options.link {
            make_link(&path, link)?;
        }
        let start_us = options.clock.now_us();
        let pins = Pins {
            index: IndexInput::ByAngle,
            emergency: false,
            battery: battery_reading(options.battery),
        };
        let shared = Arc::new(Shared {
            stop: AtomicBool::new(false),
            pins: Mutex::new(pins),
            truth: Mutex::new(Truth::new(options.start_angle, start_us)),
            counts: Mutex::new(SimulatorCounts::default()),
        });
        let mut simulator = Simulator {
            path,
            link: options.link.clone(),
            shared: Arc::clone(&shared),
            thread: None,
        };
        let rig = Rig::new(options, terminal, shared, start_us);
        let thread = std::thread::Builder::new().name("simulator".to_owned());
        simulator.thread = Some(thread.spawn(move || rig.run()).map_err(Error::Thread)?);
        Ok(simulator)
    }

    /// The port that a host opens.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Where the table stood at a time of the simulator's clock: degrees, not wound back after
    /// a turn. What has not happened yet counts as rest.
    pub fn angle_at(&self, us: i64) -> f64 {
        lock(&self.shared.truth).angle_at(us)
    }

    /// Every step so far; of very many, the last two million.
    pub fn edges(&self) -> Vec<StepEdge> {
        lock(&self.shared.truth).edges()
    }

    /// What happened so far.
    pub fn counts(&self) -> SimulatorCounts {
        *lock(&self.shared.counts)
    }

    /// Holds the index input closed or open, or (`None`) lets the angle decide.
    pub fn hold_index(&self, level: Option<bool>) {
        lock(&self.shared.pins).index = match level {
            Some(level) => IndexInput::Held(level),
            None => IndexInput::ByAngle,
        };
    }

    /// Presses the emergency stop, or releases it.
    pub fn press_emergency_stop(&self, pressed: bool) {
        lock(&self.shared.pins).emergency = pressed;
    }

    /// Sets the battery's voltage.
    pub fn set_battery(&self, volts: f64) {
        lock(&self.shared.pins).battery = battery_reading(volts);
    }

    /// Switches the table off, and tells what happened.
    pub fn stop(mut self) -> SimulatorCounts {
        self.end();
        self.counts()
    }

    fn end(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A panic in there has been told by the thread itself.
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

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn battery_reading(volts: f64) -> u16 {
    (volts / BATTERY_SCALE * BATTERY_FULL)
        .round()
        .clamp(0.0, BATTERY_FULL) as u16
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
