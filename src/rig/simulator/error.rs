//! The errors of the simulator.

use std::io;
use std::path::PathBuf;

use rustix::io::Errno;

/// An error of the simulator.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
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
