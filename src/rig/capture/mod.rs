//! The capture: from a rig that stands still to a session folder that holds one whole turn.
//!
//! ```text
//! settings -> equipment -> preflight -> (metering) -> turn + recorder -> angles, verdict -> session
//! ```
//!
//! [`capture`] makes one session: it checks and holds everything, turns the table, and records
//! exactly the frames of 360 degrees.
//!
//! A [`Recorder`] has the camera in a thread of its own, so that nothing that happens elsewhere
//! costs a frame: a slow disk has a queue before it, and those who look at the [`Preview`] are never
//! waited for. When the turn begins may be told after the fact ([`Window`]). What is on the disk is
//! never older than a second, and [`salvage`] brings a session to its end whose recorder died. The
//! recorder knows cameras, videos and sessions, and nothing of turntables: the time of a turn and
//! the angle at a time are given to it.

mod equipment;
mod error;
mod facts;
mod failure;
mod faults;
mod film;
pub mod look;
pub mod meter;
mod metering;
pub mod preflight;
mod preview;
pub(crate) mod recorder;
mod salvage;
mod settings;
mod shoot;
mod sink;
mod stop;
mod take;
pub mod trace;
mod tracking;
mod window;

pub use equipment::Equipment;
pub use error::Error;
pub use failure::{CaptureError, MeterFault, Refusal};
pub use preview::Preview;
pub use recorder::{Ended, Plan, Progress, Recorder, Stage, WhenFull};
pub use salvage::{Salvaged, Saved, salvage, salvage_session};
pub use settings::{FrameSize, ModeWish, Settings};
pub use shoot::{Onlookers, Order, capture};
pub use stop::{StopRequest, Stopped};
pub use take::{Damaged, End, Report, Take};
pub use window::{Count, Window};

#[cfg(test)]
mod tests;
