//! What a page, a terminal or a script may ask of a rig, whatever drives it.

use std::path::Path;

use serde::{Deserialize, Deserializer, Serialize};

use crate::state::{Monitor, Obstacle, RigState};

/// Something a person at the rig asks for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "command", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Command {
    /// Captures one turn of the object that stands on the table.
    Start {
        /// The object's name, as it goes into the session's.
        object: String,
        /// Whether a metering turn comes first.
        #[serde(default)]
        meter: bool,
    },
    /// Stops the table and ends the take that is under way; what was recorded stays, marked aborted.
    Stop,
    /// Appends an object to the queue.
    Enqueue {
        /// The object's name.
        object: String,
    },
    /// Takes an object out of the queue.
    Dequeue {
        /// Its place, 0 is next.
        place: usize,
        /// The object that is meant: where another one stands there by now, the command is refused.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        object: Option<String>,
    },
    /// The next object of the queue stands on the table: captures it. It leaves the queue when its take
    /// is usable.
    Next {
        /// The object that is meant: where another one is next by now, the command is refused.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        object: Option<String>,
    },
    /// Finds the table's zero.
    Home,
    /// Turns the table by so many degrees.
    Jog {
        /// Degrees, positive or negative.
        degrees: f64,
    },
    /// Releases the table's lock after an alarm.
    Unlock,
    /// Brings the table back after an alarm of any kind, also after an emergency stop once it is
    /// released: resets, unlocks and homes it.
    Reset,
    /// Changes how takes are captured, while the rig rests; what is left out stays.
    Configure {
        /// Frame width and height, pixels; `null` takes the largest.
        #[serde(
            default,
            deserialize_with = "given",
            skip_serializing_if = "Option::is_none"
        )]
        size: Option<Option<(u32, u32)>>,
        /// Frames a second, 1 to 1000.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        fps: Option<f64>,
        /// Speed of the turn, 0.1 to 360 degrees a second.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        degrees_per_second: Option<f64>,
        /// Frames that may be missing or damaged.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        max_dropped: Option<u64>,
        /// How often a take that is not usable is repeated, up to 100.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        retries: Option<u32>,
    },
    /// Sets one of the camera's controls by its name.
    SetControl {
        /// The control's name, such as `exposure_time_absolute`.
        name: String,
        /// The value, in the control's own units.
        value: i64,
    },
}

/// Why a command was not taken: a sentence for the person who gave it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Refused {
    /// Something else is under way.
    #[error("{0}")]
    Busy(String),
    /// The command makes no sense as given.
    #[error("{0}")]
    Invalid(String),
    /// What is needed is not there: camera, table, disk.
    #[error("{0}")]
    Unavailable(String),
}

impl From<Obstacle> for Refused {
    fn from(obstacle: Obstacle) -> Self {
        Self::Unavailable(obstacle.to_string())
    }
}

impl Command {
    /// Whether the rig, as it stands, can do this at all. Whether something else is under way is another
    /// question.
    ///
    /// # Errors
    /// [`Refused::Unavailable`] with what is in the way.
    pub fn check(&self, state: &RigState) -> Result<(), Refused> {
        // An empty queue is the better answer to `next`.
        let captures = match self {
            Self::Start { .. } => true,
            Self::Next { .. } => !state.queue.is_empty(),
            _ => false,
        };
        let moves = matches!(
            self,
            Self::Home | Self::Jog { .. } | Self::Unlock | Self::Reset
        );
        if moves && !state.has_table() {
            let none = "there is no turntable: give --turntable".to_owned();
            return Err(Refused::Unavailable(none));
        }
        let obstacle = match (captures, moves) {
            (true, _) => state.obstacle_to_take(),
            // A locked table takes no motion; what lifts the lock is another matter.
            (_, true) if matches!(self, Self::Jog { .. }) => state.obstacle_of_table(),
            (_, true) => state.obstacle_to_motion(),
            _ => None,
        };
        obstacle.map_or(Ok(()), |obstacle| Err(obstacle.into()))
    }
}

/// Reads a field that may be `null`, which differs from one that is left out.
fn given<'de, T: Deserialize<'de>, D: Deserializer<'de>>(from: D) -> Result<Option<T>, D::Error> {
    T::deserialize(from).map(Some)
}

/// A rig that takes commands and shows its state.
pub trait Rig: Send + Sync {
    /// Takes a command; what comes of it shows in the monitor.
    ///
    /// # Errors
    /// [`Refused`] where it cannot be begun.
    fn command(&self, command: Command) -> Result<(), Refused>;

    /// The state and the newest picture.
    fn monitor(&self) -> &Monitor;

    /// Whether commands are still carried out: false once what does so has ended or failed.
    fn is_running(&self) -> bool;

    /// The folder in which sessions lie.
    fn root(&self) -> &Path;
}
