//! The rig as a daemon: it takes commands, and one thread that has camera and table carries them out.
//!
//! What is to be done, and what a stop means, is decided by the `dispatcher`; the `worker` does it, and keeps
//! pictures and state fresh in between. Commands are checked where they
//! are given. When the daemon is dropped, a take under way is aborted and closed, the table stands, and
//! the thread has ended.

mod dispatcher;
mod idle;
mod worker;

use std::fs::{File, TryLockError};
use std::io;
use std::os::unix::fs::OpenOptionsExt as _;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use crate::capture::{CaptureError, Equipment, Settings, preflight, recover};
use crate::command::{Command, CommandError, Rig};
use crate::preview::Preview;
use crate::state::{Monitor, RigState};
use dispatcher::Dispatcher;
use relit_data::clock::{Clock, JoinHandle};
use relit_turntable::holder;
use relit_turntable::simulator::SimulatedTable;
use rustix::fs::OFlags;
use worker::Worker;

/// The file in a folder of sessions that its daemon keeps locked.
const LOCK_FILE: &str = ".relit-capture.lock";
/// Farthest that a table is turned by one command, degrees.
const FARTHEST_JOG: f64 = 800.0;

/// A rig that takes commands until it is dropped.
#[derive(Debug)]
pub struct Daemon {
    dispatcher: Arc<Dispatcher>,
    root: PathBuf,
    simulator: Option<SimulatedTable>,
    worker: Mutex<Option<JoinHandle<()>>>,
    _lock: File,
}

impl Daemon {
    /// Takes the folder for this process, recovers sessions whose recorder died, and starts
    /// the worker, which opens camera and table, and keeps trying while they are not there.
    /// `failed` is called if the worker panics: nothing is carried out any more, and the process should end.
    ///
    /// # Errors
    /// [`CaptureError::InUse`] if another daemon has it, [`CaptureError::Refused`] for speeds that do not fit, or what
    /// the system answers.
    pub fn start(
        settings: Settings,
        failed: impl FnOnce() + Send + 'static,
    ) -> Result<Self, CaptureError> {
        let root = settings.root.clone();
        let shown = settings.shown();
        let equipment = Equipment::for_viewers(settings)?;
        let lock = lock(&root)?;
        let dispatcher = Arc::new(Dispatcher::new(equipment.clock()));
        let show = |state: &mut RigState| state.settings = shown;
        dispatcher.monitor().update(show);
        report_recovered(&root, &equipment.clock(), dispatcher.monitor())?;
        let thread = |source| CaptureError::system("a thread", "started")(source);
        let preview = Preview::start(dispatcher.monitor().clone()).map_err(thread)?;
        let clock = equipment.clock();
        let simulator = equipment.simulator().cloned();
        let mut worker = Worker::new(equipment, Arc::clone(&dispatcher), preview);
        let worker = spawn(&clock, failed, move || worker.run()).map_err(thread)?;
        Ok(Self {
            dispatcher,
            root,
            simulator,
            worker: Mutex::new(Some(worker)),
            _lock: lock,
        })
    }

    /// The simulated table, if there is one: whoever rehearses with it presses its emergency stop.
    pub fn simulator(&self) -> Option<&SimulatedTable> {
        self.simulator.as_ref()
    }

    /// Aborts what is under way, stops the table, and comes back when all of it is done. Does nothing
    /// the second time. False if the worker panicked; its table was stopped then, too.
    pub fn end(&self) -> bool {
        self.dispatcher.end();
        let worker = self.worker.lock();
        let worker = worker.unwrap_or_else(PoisonError::into_inner).take();
        worker.is_none_or(|worker| worker.join().is_ok())
    }
}

impl Rig for Daemon {
    fn command(&self, command: Command) -> Result<(), CommandError> {
        let dispatcher = &self.dispatcher;
        // A name that cannot be is the better answer than a camera that is away.
        if let Command::Start { object } = &command {
            check_object(object)?;
        }
        if let Command::Jog { degrees } = command {
            check_jog(degrees)?;
        }
        command.check(&dispatcher.monitor().state())?;
        match command {
            Command::Stop => {
                dispatcher.stop();
                Ok(())
            }
            command => dispatcher.submit(command),
        }
    }

    fn monitor(&self) -> &Monitor {
        self.dispatcher.monitor()
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

/// Takes a folder of sessions, until the file is closed or the process dies.
fn lock(root: &Path) -> Result<File, CaptureError> {
    let path = root.join(LOCK_FILE);
    let failed = |doing| CaptureError::system(path.display().to_string(), doing);
    // No link, and nothing that keeps an opener waiting: the folder may belong to somebody else.
    let flags = OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::NOCTTY;
    let mut options = File::options();
    options.write(true).create(true).truncate(false);
    let file = options
        .custom_flags(flags.bits().cast_signed())
        .open(&path)
        .map_err(failed("opened"))?;
    if !file.metadata().map_err(failed("opened"))?.is_file() {
        return Err(failed("opened")(io::Error::other("it is not a plain file")));
    }
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => {
            drop(file);
            Err(CaptureError::InUse {
                root: root.to_owned(),
                pid: holder(&path),
            })
        }
        Err(TryLockError::Error(error)) => Err(failed("locked")(error)),
    }
}

/// Starts the worker's thread, which calls `failed` where it panics.
fn spawn(
    clock: &Clock,
    failed: impl FnOnce() + Send + 'static,
    work: impl FnOnce() + Send + 'static,
) -> io::Result<JoinHandle<()>> {
    clock.spawn("relit-rig", move || {
        if let Err(panic) = catch_unwind(AssertUnwindSafe(work)) {
            failed();
            resume_unwind(panic);
        }
    })
}

fn check_jog(degrees: f64) -> Result<(), CommandError> {
    if degrees.is_finite() && degrees.abs() <= FARTHEST_JOG {
        Ok(())
    } else {
        Err(CommandError::Invalid(format!(
            "the table cannot be turned by {degrees} degrees"
        )))
    }
}

fn check_object(object: &str) -> Result<(), CommandError> {
    preflight::check_object(object).map_err(CommandError::Invalid)
}

/// Recovers what an earlier run left, and reports the result.
fn report_recovered(root: &Path, clock: &Clock, monitor: &Monitor) -> Result<(), CaptureError> {
    for found in recover(root)? {
        monitor.fault(clock.now_us(), found.to_string());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_that_is_a_link_or_a_pipe_is_refused_and_what_it_leads_to_stays() {
        let root = tempfile::tempdir().unwrap();
        let (path, precious) = (root.path().join(LOCK_FILE), root.path().join("precious"));
        std::fs::write(&precious, "precious").unwrap();
        std::os::unix::fs::symlink(&precious, &path).unwrap();
        assert!(matches!(
            lock(root.path()),
            Err(CaptureError::System { .. })
        ));
        assert_eq!(std::fs::read(&precious).unwrap(), b"precious");
        std::fs::remove_file(&path).unwrap();
        let mode = rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR;
        rustix::fs::mkfifoat(rustix::fs::CWD, &path, mode).unwrap();
        assert!(matches!(
            lock(root.path()),
            Err(CaptureError::System { .. })
        ));
    }

    #[test]
    fn a_worker_that_panics_ends_the_program() {
        let (tell, told) = std::sync::mpsc::sync_channel(1);
        let failed = move || tell.send(()).unwrap();
        let work = || resume_unwind(Box::new(()));
        let worker = spawn(&Clock::virtual_time(), failed, work).unwrap();
        assert!(worker.join().is_err());
        told.recv().unwrap();
    }
}
