//! What a page, a terminal or a script may ask of a rig, whatever drives it.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::state::{Monitor, Obstacle, RigState};

/// Something a person at the rig asks for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "command", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Command {
    /// Captures one turn of the object that stands on the table.
    Start {
        /// The object's name, as it goes into the session's.
        object: String,
    },
    /// Stops the table and ends the take that is under way; what was recorded stays, marked aborted.
    Stop,
    /// Finds the table's zero.
    Home,
    /// Turns the table by so many degrees.
    Jog {
        /// Degrees, positive or negative.
        degrees: f64,
    },
    /// Brings the table back after an alarm of any kind, also after an emergency stop once it is
    /// released: resets, unlocks and homes it.
    Reset,
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
pub enum CommandError {
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

impl From<Obstacle> for CommandError {
    fn from(obstacle: Obstacle) -> Self {
        Self::Unavailable(obstacle.to_string())
    }
}

impl Command {
    /// Whether the rig, as it stands, can do this at all. Whether something else is under way is another
    /// question.
    ///
    /// # Errors
    /// [`CommandError::Unavailable`] with what is in the way.
    pub fn check(&self, state: &RigState) -> Result<(), CommandError> {
        let moves = matches!(self, Self::Home | Self::Jog { .. } | Self::Reset);
        if moves && !state.has_table() {
            let none = "no turntable is known: give --turntable".to_owned();
            return Err(CommandError::Unavailable(none));
        }
        let obstacle = match self {
            Self::Start { .. } => state.obstacle_to_take(),
            // A locked table takes no motion; what lifts the lock is another matter.
            Self::Jog { .. } => state.obstacle_of_table(),
            Self::Home | Self::Reset => state.obstacle_to_motion(),
            Self::Stop | Self::SetControl { .. } => None,
        };
        obstacle.map_or(Ok(()), |obstacle| Err(obstacle.into()))
    }
}

/// A rig that takes commands and shows its state.
pub trait Rig: Send + Sync {
    /// Takes a command; the result shows in the monitor.
    ///
    /// # Errors
    /// [`CommandError`] if it cannot be begun.
    fn command(&self, command: Command) -> Result<(), CommandError>;

    /// The state and the newest picture.
    fn monitor(&self) -> &Monitor;

    /// The folder in which sessions lie.
    fn root(&self) -> &Path;
}
