//! The rig as a daemon has it: a thread that owns camera and table, and takes commands.
//!
//! Commands are checked where they are given and done one after the other by the owner. A stop does
//! not queue: it reaches whatever is under way at once. When the daemon is dropped, a take under way
//! is aborted and closed, the table stands, and the owner has ended.

pub(crate) mod idle;
mod owner;
mod viewer;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use crate::capture::CaptureError;
use crate::capture::Equipment;
use crate::capture::Order;
use crate::capture::Settings;
use crate::capture::{StopRequest, Stopped};
use crate::capture::{preflight, salvage};
use crate::clock::Clock;
use crate::lockfile::LockFile;
use crate::serve::rig::{Command, Refused, Rig};
use crate::state::{Monitor, Phase, RigState};
use owner::{Job, Owner, rest};
pub use viewer::Viewer;

/// Commands that wait for the owner.
const WAITING: usize = 8;
/// Objects that wait for their turn.
const LONGEST_QUEUE: usize = 100;
/// Farthest that a table is turned by one command, degrees.
const FARTHEST_JOG: f64 = 800.0;

/// A rig that takes commands until it is dropped.
#[derive(Debug)]
pub struct Daemon {
    monitor: Monitor,
    root: PathBuf,
    commands: SyncSender<Job>,
    busy: Arc<AtomicBool>,
    stop: StopRequest,
    wants_table: bool,
    owner: Mutex<Option<JoinHandle<()>>>,
    _locks: (LockFile, Option<LockFile>),
}

impl Daemon {
    /// Takes folder and camera for this process, salvages sessions whose recorder died, and starts
    /// the owner, which looks for camera and table, and keeps looking where they are not there.
    ///
    /// # Errors
    /// [`CaptureError::Lock`] where another daemon has them, [`super::Refusal::Pace`], or what the
    /// system answers.
    pub fn start(settings: Settings) -> Result<Self, CaptureError> {
        let locks = (LockFile::of_root(&settings.root)?, settings.lock_camera()?);
        let monitor = Monitor::default();
        tell_salvaged(&settings.root, &monitor)?;
        let root = settings.root.clone();
        let equipment = Equipment::new(settings)?;
        let wants_table = equipment.wants_table();
        let thread = |source| CaptureError::system("a thread", "started")(source);
        let viewer = Viewer::start(monitor.clone()).map_err(thread)?;
        let (commands, queue) = sync_channel(WAITING);
        let (busy, stop) = (Arc::new(AtomicBool::new(false)), StopRequest::default());
        let (shown, freed) = (monitor.clone(), Arc::clone(&busy));
        let mut owner = Owner::new(equipment, shown, viewer, freed, stop.clone());
        let owner = std::thread::Builder::new()
            .name("relit-rig".to_owned())
            .spawn(move || owner.run(&queue))
            .map_err(thread)?;
        Ok(Self {
            monitor,
            root,
            commands,
            busy,
            stop,
            wants_table,
            owner: Mutex::new(Some(owner)),
            _locks: locks,
        })
    }

    /// Aborts what is under way, stops the table, and comes back when all of it is done. Does nothing
    /// the second time.
    pub fn end(&self) {
        self.stop.ask(Stopped::Shutdown);
        let owner = self
            .owner
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        if let Some(owner) = owner {
            // A panic in there was told by the thread itself, and its table was stopped.
            let _ = owner.join();
        }
    }

    /// Hands a job to the owner, unless it is busy.
    fn begin(&self, job: Job) -> Result<(), Refused> {
        let order = Ordering::AcqRel;
        if self
            .busy
            .compare_exchange(false, true, order, Ordering::Acquire)
            .is_err()
        {
            return Err(Refused::Busy(busy_with(&self.monitor.state())));
        }
        // The owner forgets old wishes to stop before it counts as free.
        self.commands.try_send(job).map_err(|_| {
            self.busy.store(false, Ordering::Release);
            Refused::Unavailable("the rig is about to end: start the program again".to_owned())
        })
    }

    fn capture(&self, object: String, meter: bool) -> Result<(), Refused> {
        checked(&object)?;
        let camera = self.monitor.state().camera;
        if !camera.present {
            let why = camera
                .fault
                .unwrap_or_else(|| "there is no camera yet".to_owned());
            return Err(Refused::Unavailable(why));
        }
        self.begin(Job::Capture(Order { object, meter }))
    }

    fn next(&self) -> Result<(), Refused> {
        let queued = self.monitor.state().queue.first().cloned();
        let object = queued.ok_or_else(|| Refused::Invalid("no object is queued".to_owned()))?;
        self.capture(object, false)?;
        self.monitor.update(|state| {
            if !state.queue.is_empty() {
                state.queue.remove(0);
            }
        });
        Ok(())
    }

    fn enqueue(&self, object: String) -> Result<(), Refused> {
        checked(&object)?;
        let mut taken = false;
        self.monitor.update(|state| {
            taken = state.queue.len() < LONGEST_QUEUE;
            if taken {
                state.queue.push(object);
                rest(state, &self.busy);
            }
        });
        match taken {
            true => Ok(()),
            false => Err(Refused::Invalid(format!(
                "{LONGEST_QUEUE} objects are queued already"
            ))),
        }
    }

    fn dequeue(&self, place: usize) -> Result<(), Refused> {
        let mut taken = false;
        self.monitor.update(|state| {
            taken = place < state.queue.len();
            if taken {
                state.queue.remove(place);
                rest(state, &self.busy);
            }
        });
        let none = || Refused::Invalid(format!("the queue has no place {place}"));
        taken.then_some(()).ok_or_else(none)
    }

    fn turn(&self, job: Job) -> Result<(), Refused> {
        if !self.wants_table {
            return Err(Refused::Unavailable(
                "there is no turntable: give --turntable".to_owned(),
            ));
        }
        self.begin(job)
    }

    fn jog(&self, degrees: f64) -> Result<(), Refused> {
        if !degrees.is_finite() || degrees.abs() > FARTHEST_JOG {
            let what = format!("the table cannot be turned by {degrees} degrees");
            return Err(Refused::Invalid(what));
        }
        self.turn(Job::Jog(degrees))
    }

    fn stop(&self) -> Result<(), Refused> {
        if self.busy.load(Ordering::Acquire) {
            self.stop.ask(Stopped::Person);
            return Ok(());
        }
        match self.begin(Job::StopTable) {
            // Something has begun just now: it is that which is to stop.
            Err(Refused::Busy(_)) => {
                self.stop.ask(Stopped::Person);
                Ok(())
            }
            begun => begun,
        }
    }
}

impl Rig for Daemon {
    fn command(&self, command: Command) -> Result<(), Refused> {
        match command {
            Command::Start { object, meter } => self.capture(object, meter),
            Command::Stop => self.stop(),
            Command::Enqueue { object } => self.enqueue(object),
            Command::Dequeue { place } => self.dequeue(place),
            Command::Next => self.next(),
            Command::Home => self.turn(Job::Home),
            Command::Jog { degrees } => self.jog(degrees),
            Command::Unlock => self.turn(Job::Unlock),
            Command::SetControl { name, value } => self.begin(Job::SetControl(name, value)),
        }
    }

    fn monitor(&self) -> &Monitor {
        &self.monitor
    }

    fn root(&self) -> &Path {
        &self.root
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        self.end();
    }
}

fn checked(object: &str) -> Result<(), Refused> {
    preflight::check_object(object).map_err(|refusal| Refused::Invalid(refusal.to_string()))
}

fn busy_with(state: &RigState) -> String {
    match (&state.object, state.phase) {
        (Some(object), phase) if !matches!(phase, Phase::Idle | Phase::WaitingForObject) => {
            format!("{object} is being captured: wait for it, or stop it")
        }
        _ => "the table or the camera is being set: wait a moment".to_owned(),
    }
}

/// Salvages what an earlier run left, and says so.
fn tell_salvaged(root: &Path, monitor: &Monitor) -> Result<(), CaptureError> {
    for found in salvage(root)? {
        let session = found
            .folder
            .file_name()
            .unwrap_or_default()
            .to_string_lossy();
        let told = match &found.saved {
            Ok(saved) => format!("{session} was interrupted, and is kept as aborted: {saved}"),
            Err(error) => format!("{session} was interrupted and could not be salvaged: {error}"),
        };
        monitor.fault(Clock::monotonic().now_us(), told);
    }
    Ok(())
}
