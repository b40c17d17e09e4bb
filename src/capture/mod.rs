//! The capture: from a rig that stands still to a session folder that holds one whole turn.
//!
//! ```text
//! settings -> preflight -> (metering) -> take: turn + recorder -> angles, verdict -> session
//! ```

mod coding;
mod failure;
pub mod look;
pub mod meter;
mod metering;
pub mod preflight;
pub mod rig;
mod settings;
pub mod state;
mod stop;
pub mod trace;

pub use failure::{CaptureError, MeterFault, Refusal};
pub use settings::{FrameSize, ModeWish, Settings};
pub use stop::{StopRequest, Stopped};
