//! The errors of the simulator.

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
    /// A pseudoterminal, its link or a thread could not be had; why, and what to do.
    #[error("{0}")]
    System(String),
}
