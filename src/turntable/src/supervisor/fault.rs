//! Why a motion ended that had not arrived.

use crate::codes::Alarm;
use crate::protocol::{ControllerState, LineFault};

/// The fault that ended a motion. The table is being stopped then, or has been.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MotionFault {
    /// The controller restarted.
    #[error("the controller restarted{}, and its position is lost; check its supply and cable, then home it", .0.as_ref().map_or_else(String::new, |cause| format!(" ({cause})")))]
    Restarted(Option<String>),
    /// An alarm.
    #[error("{0}")]
    Alarm(Alarm),
    /// The table was put on hold, but not by this program.
    #[error(
        "something else put the table on hold; look for a button or another sender, and start again"
    )]
    Held,
    /// The controller fell silent.
    #[error("the controller was silent for {milliseconds} ms; check cable and power")]
    Silent {
        /// Duration of the silence.
        milliseconds: i64,
    },
    /// The controller reports motion but always the same position.
    #[error("the controller reports motion and stays at {machine_deg:.3} degrees; restart it")]
    Stalled {
        /// The place, from machine zero.
        machine_deg: f64,
    },
    /// The table stands in another place than its target, or does something else.
    #[error(
        "the table was sent to {target_deg:.3} degrees and is in state {state} at {machine_deg:.3} (from machine zero); check cable and other senders, then home it"
    )]
    Astray {
        /// Its state.
        state: ControllerState,
        /// Where it is, from machine zero.
        machine_deg: f64,
        /// Where it was sent, from machine zero.
        target_deg: f64,
    },
    /// It did not arrive in time.
    #[error("the table did not arrive in time; compare its speed with the settings $110 and $120")]
    Late,
    /// The line that moves the table got no answer.
    #[error("the line that moves it may or may not have arrived: {0}")]
    Line(LineFault),
    /// The port is gone.
    #[error("the port is gone ({0}); check that the controller is plugged in")]
    PortLost(String),
    /// A stop was requested.
    #[error("a stop was requested")]
    Stopped,
}
