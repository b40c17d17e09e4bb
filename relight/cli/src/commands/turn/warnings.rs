//! Warnings with the options that mend them.

use relight_turn::{SolvedTurn, TurnWarning};
use relit_console::Console;
use relit_data::rig::RotationDirection;

/// Says what a user should know of a turn, each with what to give instead.
pub(super) fn warn_of(solved: &SolvedTurn, console: Console) {
    let direction = solved.turn.rotation.direction;
    for warning in solved.warnings() {
        let advice = advice(&warning, direction).unwrap_or_default();
        console.warn(&format!("{warning}{advice}"));
    }
}

fn advice(warning: &TurnWarning, direction: RotationDirection) -> Option<String> {
    let other = direction.other();
    Some(match warning {
        TurnWarning::SurerInOtherDirection { .. } => format!(": try --rotation {other}"),
        TurnWarning::AssumedElevation { .. } => ": give --elevation".to_owned(),
        TurnWarning::AssumedRotation { .. } => {
            ": look at it from above as it turns, and give --rotation".to_owned()
        }
        TurnWarning::TakenRotation { .. } => {
            format!("; give --rotation {direction} if that is right, else {other}")
        }
        _ => return None,
    })
}
