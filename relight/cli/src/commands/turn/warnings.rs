//! Warnings with the options that mend them.

use relight_turn::{RotationDirection, TurnWarning};
use relit_console::Console;

pub(super) fn warn(text: &str, console: Console) {
    console.warn(text);
}

/// Says warnings of a turn that was taken to rotate this way, each with what to give instead.
pub(super) fn warn_of(
    warnings: impl IntoIterator<Item = TurnWarning>,
    direction: RotationDirection,
    console: Console,
) {
    for warning in warnings {
        match advice(&warning, direction) {
            Some(advice) => warn(&format!("{warning}{advice}"), console),
            None => warn(&warning.to_string(), console),
        }
    }
}

fn advice(warning: &TurnWarning, direction: RotationDirection) -> Option<String> {
    let other = direction.other();
    Some(match warning {
        TurnWarning::BackgroundMovesOtherWay => format!(", give --direction {other}"),
        TurnWarning::OtherDirection { .. } | TurnWarning::SurerInOtherDirection { .. } => {
            format!(": try --direction {other}")
        }
        TurnWarning::AssumedElevation { .. } => ": give --elevation or --rim".to_owned(),
        TurnWarning::AssumedRotation { .. } => {
            ": look at it from above as it turns, and give --direction".to_owned()
        }
        TurnWarning::TakenRotation { direction, .. } => {
            format!(
                "; give --direction {direction} if that is right, else {}",
                direction.other()
            )
        }
        TurnWarning::OtherMaterial { material, .. } => format!(": try --material {material}"),
        TurnWarning::MetalInUnknownLight => {
            ": give --material metal if that is right, else diffuse".to_owned()
        }
        _ => return None,
    })
}
