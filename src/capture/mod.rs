//! A turn as a session on disk: which frames belong to it, which are missing, and what the take is
//! worth.
//!
//! A [`Recorder`] has the camera in a thread of its own, so that nothing that happens elsewhere
//! costs a frame: a slow disk has a queue before it, and those who look at the [`Preview`] are never
//! waited for. When the turn begins may be told after the fact ([`Window`]). What is on the disk is
//! never older than a second, and [`salvage`] brings a session to its end whose recorder died.
//!
//! This room knows cameras, videos and sessions. It knows nothing of turntables: the time of a turn
//! and the angle at a time are given to it.

mod error;
mod faults;
mod film;
mod preview;
mod recorder;
mod salvage;
mod sink;
mod take;
pub mod trace;
mod window;

pub use error::Error;
pub use preview::Preview;
pub use recorder::{Ended, Plan, Progress, Recorder, Stage, WhenFull};
pub use salvage::{Salvaged, Saved, salvage, salvage_session};
pub use take::{Damaged, End, Report, Take};
pub use window::{Count, Window};

#[cfg(test)]
mod tests;
