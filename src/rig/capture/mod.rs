//! The capture: from a rig at rest to a session folder that holds one whole turn.
//!
//! ```text
//! settings -> equipment -> preflight -> (metering) -> turn + recorder -> angles, verdict -> session
//! ```
//!
//! [`capture`] makes one session: it checks and locks everything, turns the table, and records
//! exactly the frames of 360 degrees. [`recording`] is what it records with, and knows nothing of
//! turntables. What is under way shows in a [`Monitor`](crate::state::Monitor); who looks at that,
//! and from where, the capture does not know.

mod equipment;
mod error;
pub mod locked_camera;
mod manifest;
mod metering;
pub mod preflight;
pub mod recording;
mod settings;
mod stop;
mod take;
pub(crate) mod turn;

pub use equipment::Equipment;
pub use error::{CaptureError, MeterFault, Refusal};
pub use locked_camera::LockedCamera;
pub use recording::{
    End, Plan, Progress, Recorded, Recorder, RecordingError, Salvaged, Saved, Window, salvage,
    salvage_session,
};
pub use settings::{FrameSize, ModePreference, Settings};
pub use stop::{StopRequest, Stopped};
pub use take::{CaptureContext, CaptureRequest, Captured, capture};

#[cfg(test)]
pub(crate) mod tests;
