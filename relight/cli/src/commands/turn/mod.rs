//! `relight turn`: a whole turn into normals, albedo, light and their residuals.

mod arguments;
mod observed;
mod warnings;

use std::error::Error;
use std::time::Instant;

use relight_turn::{
    AssetDestination, DestinationError, Destinations, Filmed, ProbeLight, ReadTurn, TurnError,
    TurnFigures, TurnFiles, TurnLabels, TurnMaps, TurnSolution, TurnWarning, solve_turn,
};
use relit_console::{Console, Outcome};
use serde_json::json;

pub(crate) use self::arguments::{Arguments, EXAMPLES};
use self::observed::Observed;
use self::warnings::{warn, warn_of};
use crate::commands::CommandResult;

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let start = Instant::now();
    let asset = check_destinations(arguments)?;
    let mut observed = Observed::new(arguments, console)?;
    let direction = observed.turn.rotation.direction;
    let filmed = observed.filmed.as_mut();
    let measured = filmed.map(Filmed::light).transpose()?.flatten();
    if let Some(measured) = &measured {
        warn_of(TurnWarning::of_ball(measured), direction, console);
    }
    let light_source = light_source(arguments, measured.as_ref());
    let options = observed.options(arguments, measured.map(|measured| measured.light))?;
    let Observed {
        turn,
        filmed,
        reading_seconds,
        ..
    } = observed;
    let solution = solve_turn(&turn.curves, &options)?;
    let strip = filmed.as_ref().and_then(Filmed::strip);
    let object = match asset {
        AssetDestination::None => None,
        AssetDestination::Inside | AssetDestination::Beside(_) => Some(solution.asset(&turn)?),
    };
    let figures = TurnFiles {
        turn: &turn,
        solution: &solution,
        maps: &TurnMaps::new(&turn.curves, &solution),
        light_source: light_source.as_deref(),
        normals_source: arguments.normals().map(|(_, name)| name),
        strip,
        asset: object
            .as_ref()
            .filter(|_| asset == AssetDestination::Inside),
        has_movie: !arguments.no_video,
    }
    .write(&arguments.output)?;
    if let (AssetDestination::Beside(path), Some(object)) = (asset, &object) {
        object.write(path).map_err(TurnError::from)?;
    }
    let refused = write_labels(arguments, &turn, &solution)?;
    say(
        arguments,
        &figures,
        &solution,
        [start.elapsed().as_secs_f64(), reading_seconds],
        console,
    );
    // Of a session that nobody named nothing is missed.
    if arguments.session.is_some() || strip.is_some() {
        warn_of(TurnWarning::of_background(strip), direction, console);
    }
    warn_of(TurnWarning::of_rotation(&turn), direction, console);
    let doubt = TurnWarning::of_direction(&turn, &solution);
    warn_of(doubt, direction, console);
    let warnings = TurnWarning::of_solution(&turn, &options, &solution);
    warn_of(warnings, direction, console);
    let outcome = if solution.is_whole(&turn) {
        Outcome::Whole
    } else {
        Outcome::Incomplete
    };
    let Some(refused) = refused else {
        return Ok(outcome);
    };
    warn(&refused.to_string(), console);
    Ok(Outcome::Incomplete)
}

/// Refuses places that cannot be written, before the work.
fn check_destinations(arguments: &Arguments) -> Result<AssetDestination<'_>, Box<dyn Error>> {
    let destinations = Destinations {
        output: &arguments.output,
        labels: arguments.labels.as_deref(),
        asset: arguments.asset.as_deref(),
        has_movie: !arguments.no_video,
    };
    destinations.check().map_err(|error| match error {
        DestinationError::Labels(_) => format!("--labels {error}").into(),
        DestinationError::AssetPlace { .. } => format!("--asset {error}").into(),
        error => error.into(),
    })
}

/// Where the light is from; none where it is to be found.
fn light_source(arguments: &Arguments, measured: Option<&ProbeLight>) -> Option<String> {
    let given = arguments.light.as_ref();
    let given = given.map(|path| path.display().to_string());
    given.or_else(|| measured.map(|measured| format!("probe, {}", measured.ball)))
}

/// Writes the labels that are asked for; why there are none.
fn write_labels(
    arguments: &Arguments,
    turn: &ReadTurn,
    solution: &TurnSolution,
) -> Result<Option<TurnError>, Box<dyn Error>> {
    let Some(folder) = &arguments.labels else {
        return Ok(None);
    };
    let labels = TurnLabels {
        turn,
        solution,
        least_confidence: arguments.labels_confidence,
    };
    let refused = labels.refusal();
    if refused.is_none() {
        labels.write(folder)?;
    }
    Ok(refused)
}

/// Says how it came out.
fn say(
    arguments: &Arguments,
    figures: &TurnFigures,
    solution: &TurnSolution,
    [seconds, reading_seconds]: [f64; 2],
    console: Console,
) {
    let text = format!(
        "{}: {} frames in {reading_seconds:.1} s, all in {seconds:.1} s; normals expected within {:.0} degrees (median), light {}, material {}",
        arguments.output.display(),
        figures.frames(),
        solution.expected_error_deg(),
        match (&arguments.light, arguments.probe) {
            (Some(_), _) => "given",
            (None, Some(_)) => "measured",
            (None, None) => "found",
        },
        solution.material(),
    );
    let event = json!({
        "event": "turned",
        "output": arguments.output,
        "seconds": seconds,
        "reading_seconds": reading_seconds,
        "figures": figures,
    });
    console.say(&text, &event);
}
