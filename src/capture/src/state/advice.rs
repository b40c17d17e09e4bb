//! What stands between the rig and its next take, and what a person does about it: decided once, for the page,
//! the interface for scripts, and whoever refuses a command.

use std::fmt;

use relit_data::session::object_of;
use serde::Serialize;

use super::RigState;
use super::parts::{Phase, TakeSummary, Verdict};

/// A take needs its expected size and a fifth more.
const RESERVE: f64 = 1.2;
/// By how much of itself a table's highest speed is rounded, which it counts in units a minute.
const ROUNDING: f64 = 1e-9;

/// Something that keeps a take from beginning, or the table from moving. It is shown as the sentence for the person at
/// the rig: what is wrong, and what to do.
#[derive(Debug, Clone, PartialEq)]
pub struct Obstacle {
    headline: &'static str,
    why: String,
    /// What the button says in place of the headline, and does.
    button: Option<(&'static str, Option<AdvisedAction>)>,
}

impl Obstacle {
    fn new(headline: &'static str, why: impl Into<String>) -> Self {
        Self {
            headline,
            why: why.into(),
            button: None,
        }
    }

    /// The emergency stop is pressed.
    pub(crate) fn emergency_stop() -> Self {
        let release = ("Release the emergency stop", None);
        Self {
            button: Some(release),
            ..Self::new(
                "The emergency stop is pressed",
                "the emergency stop is pressed: release it",
            )
        }
    }

    /// The obstacle that a table's highest speed is to a turn at the speed that is set, where it is one.
    pub(crate) fn from_speed(set: f64, highest: f64) -> Option<Self> {
        let why = format!(
            "the table can turn at up to {} degrees/s, but {} degrees/s is set: set a lower speed",
            rounded(highest),
            rounded(set)
        );
        (set > highest * (1.0 + ROUNDING)).then(|| Self::new("Too fast for the table", why))
    }

    fn no_camera(why: Option<&str>) -> Self {
        let none = "no camera was found yet: the rig keeps looking";
        Self::new("No camera", why.unwrap_or(none))
    }

    /// Whether the table has to be looked at before anything else.
    fn is_alarm(&self) -> bool {
        self.button.is_some()
    }
}

impl fmt::Display for Obstacle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.why)
    }
}

/// What the one button does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum AdvisedAction {
    /// Captures the object that a person names: command `start`.
    Start,
    /// Captures again what was aborted: command `start` with the object.
    Again,
    /// Stops what is under way: command `stop`.
    Stop,
    /// Brings the table back after an alarm: command `reset`.
    Reset,
}

/// The one button at the rig.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct AdvisedButton {
    /// What stands on it.
    pub text: String,
    /// What it does; `null` if nothing can be done by a button.
    pub action: Option<AdvisedAction>,
    /// The object that it captures, where that is settled.
    pub object: Option<String>,
}

/// The message for the person at the rig, and the one thing to do next.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Advice {
    /// How the rig stands, in a few words.
    pub headline: String,
    /// What is wrong and what to do, in a sentence.
    pub explanation: Option<String>,
    /// The button.
    pub button: AdvisedButton,
}

/// The advice before anything is known of the rig.
impl Default for Advice {
    fn default() -> Self {
        Self::against(&Obstacle::no_camera(None))
    }
}

impl Advice {
    pub(super) fn from_state(state: &RigState) -> Self {
        if !state.rests() {
            return Self::stopping(&capitalised(&state.phase.to_string()));
        }
        match &state.obstacle_to_take() {
            Some(alarm) if alarm.is_alarm() => Self::against(alarm),
            _ if state.table.moves() => Self::stopping("The table is moving"),
            Some(other) => Self::against(other),
            None => Self::from_ready(state),
        }
    }

    fn against(obstacle: &Obstacle) -> Self {
        let (text, action) = obstacle.button.unwrap_or((obstacle.headline, None));
        Self {
            headline: obstacle.headline.to_owned(),
            explanation: Some(sentence(&obstacle.why)),
            button: AdvisedButton {
                text: text.to_owned(),
                action,
                object: None,
            },
        }
    }

    fn stopping(headline: &str) -> Self {
        Self {
            headline: headline.to_owned(),
            explanation: None,
            button: AdvisedButton {
                text: "Stop".to_owned(),
                action: Some(AdvisedAction::Stop),
                object: None,
            },
        }
    }

    fn from_ready(state: &RigState) -> Self {
        if let Some(take) = state.last_take.as_ref().filter(|take| is_aborted(take)) {
            return Self::after_an_abort(take);
        }
        Self {
            headline: "Ready".to_owned(),
            explanation: None,
            button: AdvisedButton {
                text: "Start".to_owned(),
                action: Some(AdvisedAction::Start),
                object: None,
            },
        }
    }

    /// What failed still stands on the table: it comes again before anything else.
    fn after_an_abort(take: &TakeSummary) -> Self {
        let object = object_of(&take.session);
        let how = if take.is_stopped {
            "stopped"
        } else {
            "aborted"
        };
        Self {
            headline: format!("The take of {object} was {how}"),
            explanation: take.reason.as_deref().map(sentence),
            button: AdvisedButton {
                text: format!("Record {object} again"),
                action: Some(AdvisedAction::Again),
                object: Some(object.to_owned()),
            },
        }
    }
}

impl RigState {
    /// Whether nothing is captured at the moment.
    pub fn rests(&self) -> bool {
        self.phase == Phase::Idle
    }

    /// What keeps a take from beginning: of several obstacles the first that a person has to remove.
    pub fn obstacle_to_take(&self) -> Option<Obstacle> {
        self.obstacle_of_table()
            .or_else(|| self.obstacle_of_speed())
            .or_else(|| {
                Some(Obstacle::new(
                    "No room for a turn",
                    self.table.no_room.clone()?,
                ))
            })
            .or_else(|| self.obstacle_of_camera())
            .or_else(|| self.obstacle_of_disk())
    }

    /// What keeps the table from moving, other than that there is to be none; its lock apart, which homing lifts.
    pub fn obstacle_to_motion(&self) -> Option<Obstacle> {
        if self.table.emergency_stop || !self.table.locked {
            self.obstacle_of_table()
        } else {
            None
        }
    }

    /// What is wrong with the table, other than that there is to be none.
    pub fn obstacle_of_table(&self) -> Option<Obstacle> {
        let table = &self.table;
        let fault = table.fault.as_deref();
        if table.emergency_stop {
            return Some(Obstacle::emergency_stop());
        }
        if table.locked {
            let reset = ("Reset and home the table", Some(AdvisedAction::Reset));
            return Some(Obstacle {
                button: Some(reset),
                ..Obstacle::new(
                    "The table is locked",
                    fault.unwrap_or("the table is locked: reset it"),
                )
            });
        }
        let none = "no turntable was found yet: the rig keeps looking";
        (self.has_table() && !table.present)
            .then(|| Obstacle::new("No turntable", fault.unwrap_or(none)))
    }

    fn obstacle_of_speed(&self) -> Option<Obstacle> {
        let highest = self.table.max_degrees_per_second?;
        Obstacle::from_speed(self.settings.degrees_per_second, highest)
    }

    fn obstacle_of_camera(&self) -> Option<Obstacle> {
        let camera = &self.camera;
        (!camera.present).then(|| Obstacle::no_camera(camera.fault.as_deref()))
    }

    fn obstacle_of_disk(&self) -> Option<Obstacle> {
        if let Some(why) = &self.disk_fault {
            return Some(Obstacle::new("No folder for sessions", why));
        }
        let needed = (self.needed_bytes as f64 * RESERVE).ceil() as u64;
        let why = format!(
            "{} MB free, but a take needs {} MB, including a reserve of 20 %: free some space",
            self.free_bytes / 1_000_000,
            needed.div_ceil(1_000_000)
        );
        (self.free_bytes < needed).then(|| Obstacle::new("Too little space", why))
    }
}

fn is_aborted(take: &TakeSummary) -> bool {
    take.verdict == Verdict::Aborted
}

/// A speed as people read it.
fn rounded(degrees_per_second: f64) -> f64 {
    (degrees_per_second * 1000.0).round() / 1000.0
}

/// As a sentence by itself.
fn sentence(text: &str) -> String {
    let mut text = capitalised(text);
    if !text.ends_with(['.', '!', '?']) {
        text.push('.');
    }
    text
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(char::to_uppercase);
    first.into_iter().flatten().chain(letters).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sentences_begin_large_and_end() {
        assert_eq!(sentence("öl is low"), "Öl is low.");
        assert_eq!(sentence("it is so."), "It is so.");
        assert_eq!(sentence(""), ".");
    }
}
