//! What a user of `relight turn` should know of a result.

use relight_turn::{
    BodyKind, Conditioning, ElevationSource, ReadTurn, RoomStrip, SenseFigure, TableSense,
    TurnOptions, TurnSolution,
};
use relit_console::{Console, Outcome};

use super::arguments::SenseName;

/// A given light that leaves more than this part of what varies is not that of the turn.
const MOST_LEFT: f64 = 0.4;

pub(super) fn warn(text: &str, console: Console) {
    console.warn(text);
}

/// Says where the room does not fit.
pub(super) fn warn_of_room(strip: Option<&RoomStrip>, sense: SenseName, console: Console) {
    match strip.map(|strip| strip.figures().sense) {
        // Angles were negated for the other sense: with the right one they always grow counter-clockwise.
        Some(TableSense::CounterClockwise) => {}
        Some(TableSense::Clockwise) => {
            let text = format!(
                "the background moves the other way: the normals are mirrored, give --sense {}",
                sense.other()
            );
            warn(&text, console);
        }
        None => warn(
            "the two sides of the picture do not show the same room: there is no room.png, and the table's sense is not checked",
            console,
        ),
    }
}

/// Says what a user should know of the solution; whether something was left out.
pub(super) fn warn_of(
    turn: &ReadTurn,
    options: &TurnOptions,
    solution: &TurnSolution,
    console: Console,
) -> Outcome {
    if options.elevation.source() == ElevationSource::Assumed {
        let text = format!(
            "the camera's elevation is not known and taken as {} degrees, {} either way: give --elevation or --rim",
            options.elevation.degrees(),
            options.elevation.uncertainty_deg(),
        );
        warn(&text, console);
    }
    if !turn.has_angles {
        warn(
            "the frames have no angles: they are taken for evenly spread over one turn",
            console,
        );
    }
    for damage in &turn.damage {
        warn(damage, console);
    }
    let conditioning = solution.conditioning();
    warn_of_light(conditioning, console);
    warn_of_choices(options, solution, console);
    if solution.body() == BodyKind::Metal && options.body.is_none() && options.light.is_none() {
        warn(
            "the object is taken for metal, which in unknown light can be wrong: do not use its albedo, and give --body diffuse if it is not of metal",
            console,
        );
    }
    if turn.damage.is_empty() && conditioning.verdict.is_fit() {
        Outcome::Whole
    } else {
        Outcome::Incomplete
    }
}

fn warn_of_light(conditioning: Conditioning, console: Console) {
    if let Some(advice) = conditioning.verdict.advice() {
        warn(advice, console);
    }
    if conditioning.is_given_at_odds() {
        warn(
            "the light that was given hardly changes over the turn, but what the object shows does: it is not the light of this turn",
            console,
        );
    }
}

/// Says where what was given does not explain the turn.
fn warn_of_choices(options: &TurnOptions, solution: &TurnSolution, console: Console) {
    if let (Some(other), [given, found, ..]) = (solution.doubted_body(), solution.bodies()) {
        let name = match other {
            BodyKind::Diffuse => "diffuse",
            BodyKind::Metal => "metal",
        };
        let text = format!(
            "the other kind of object explains the turn clearly better, with {:.0} % of what varies left instead of {:.0} %: try --body {name}",
            100.0 * found.residual,
            100.0 * given.residual
        );
        warn(&text, console);
    }
    let is_explained = solution.residual() <= MOST_LEFT;
    if options.light.is_some() && !is_explained && !solution.conditioning().is_given_at_odds() {
        let text = format!(
            "the light that was given leaves {:.0} % of what varies over the turn: see that it is this turn's, in the viewer's frame at the table's angle 0",
            100.0 * solution.residual()
        );
        warn(&text, console);
    }
    if solution.is_prior_left_out() {
        warn(
            "the normals to start from agree less with the turn than a body inflated out of the outline: they were left out",
            console,
        );
    }
}

/// Says where the table seems to turn the other way.
pub(super) fn warn_of_sense(solution: &TurnSolution, sense: SenseName, console: Console) {
    if let Some(figure) = solution.sense().filter(SenseFigure::is_doubted) {
        let text = format!(
            "the turn is explained clearly better if the table turns the other way, with {:.0} % left instead of {:.0} %: try --sense {}",
            100.0 * figure.other_residual,
            100.0 * figure.residual,
            sense.other()
        );
        warn(&text, console);
    }
}
