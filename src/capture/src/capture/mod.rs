//! The capture: from a rig at rest to a session folder that holds one whole turn.
//!
//! ```text
//! settings -> equipment -> preflight -> turn + recorder -> angles, verdict -> session
//! ```
//!
//! [`capture`] makes one session: it checks and locks everything, turns the table, and records
//! exactly the frames of 360 degrees. A [`Recorder`] is what it records with, and knows nothing of
//! turntables. What is under way shows in a [`Monitor`](crate::state::Monitor); who looks at that,
//! and from where, the capture does not know.

mod calibrate;
mod context;
mod equipment;
mod error;
mod locked_camera;
mod manifest;
mod mode_preference;
pub(crate) mod preflight;
mod recording;
mod settings;
mod stop;
mod take;
pub(crate) mod turn;

pub use calibrate::{measure_rotation, read_facts, write_facts};
pub use context::CaptureContext;
pub use equipment::Equipment;
pub use error::{CaptureError, StopReason};
pub use mode_preference::ModePreference;
pub use preflight::check_object;
pub use recording::{
    EndReason, FinishedRecording, Progress, Recorder, RecordingError, RecordingPlan,
    RecoveredSession, RecoveryReport, Window, recover, recover_session,
};
pub use settings::Settings;
pub use stop::StopRequest;
pub use take::{CaptureOutcome, capture};

#[cfg(test)]
pub(crate) mod tests;
