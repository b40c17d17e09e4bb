//! Warnings with the options that mend them.

use relight_turn::TurnWarning;
use relit_console::Console;

use super::arguments::Arguments;

pub(super) fn warn(text: &str, console: Console) {
    console.warn(text);
}

/// Says warnings, each with what to give instead.
pub(super) fn warn_of(
    warnings: impl IntoIterator<Item = TurnWarning>,
    arguments: &Arguments,
    console: Console,
) {
    for warning in warnings {
        match advice(&warning, arguments) {
            Some(advice) => warn(&format!("{warning}{advice}"), console),
            None => warn(&warning.to_string(), console),
        }
    }
}

fn advice(warning: &TurnWarning, arguments: &Arguments) -> Option<String> {
    let other = arguments.direction_name().other();
    Some(match warning {
        TurnWarning::BackgroundMovesOtherWay => format!(", give --direction {other}"),
        TurnWarning::OtherDirection { .. } | TurnWarning::SurerInOtherDirection { .. } => {
            format!(": try --direction {other}")
        }
        TurnWarning::AssumedElevation { .. } => ": give --elevation or --rim".to_owned(),
        TurnWarning::OtherMaterial { material, .. } => format!(": try --material {material}"),
        TurnWarning::MetalInUnknownLight => {
            ", and give --material diffuse if it is not of metal".to_owned()
        }
        _ => return None,
    })
}
