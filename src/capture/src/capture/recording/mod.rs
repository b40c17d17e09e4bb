//! Recording one turn of a started camera into a session folder.
//!
//! A [`Recorder`] reads the camera in its own thread, so that nothing that happens elsewhere
//! costs a frame: the disk has a queue and a thread before it, and the preview never
//! holds it up. The time of the turn may be announced after it began ([`Window`]). What is on the
//! disk is never older than a second, and [`recovery`] closes a session whose recorder died.
//!
//! ```text
//! camera thread -> trimmer -> queue -> writer thread     CameraOutcome, WriterOutcome
//!                                                    ->  Recorded -> TakeSummary, session.json
//! ```
//!
//! It knows cameras, videos and sessions, and nothing of turntables: the time of a turn, the reports
//! for the journal and the angle at a time are given to it. Recovery alone asks for the angles that
//! follow from a journal.

mod camera_thread;
mod environment_light;
mod error;
mod finding;
mod outcome;
mod progress;
mod recorder;
mod recovery;
mod timing;
mod trimmer;
mod verdict;
mod writer_thread;

pub use error::RecordingError;
pub use outcome::EndReason;
pub use progress::{Progress, Window};
pub use recorder::{Recorder, RecordingPlan};
pub use recovery::{RecoveredSession, RecoveryReport, recover, recover_session};
pub use verdict::FinishedRecording;
