//! `relight turn`: a whole turn into normals, albedo, light and their residuals.

mod arguments;
mod warnings;

use std::error::Error;
use std::time::Instant;

use relight_turn::{
    AssetDestination, DestinationError, Destinations, ProbeLight, SolvedTurn, TurnError,
    TurnFigures, TurnFiles, solve_turn,
};
use relit_console::{Console, Outcome};
use serde_json::json;

pub(crate) use self::arguments::{Arguments, EXAMPLES};
use self::warnings::warn_of;
use crate::commands::CommandResult;

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let start = Instant::now();
    let asset = check_destinations(arguments)?;
    let solved = solve(arguments, console)?;
    let object = match asset {
        AssetDestination::None => None,
        AssetDestination::Inside | AssetDestination::Beside(_) => {
            Some(solved.solution.asset(&solved.turn)?)
        }
    };
    let figures = TurnFiles {
        solved: &solved,
        light_source: light_source(arguments, solved.ball.as_ref()).as_deref(),
        asset: object
            .as_ref()
            .filter(|_| asset == AssetDestination::Inside),
        has_movie: !arguments.no_video,
    }
    .write(&arguments.output)?;
    if let (AssetDestination::Beside(path), Some(object)) = (asset, &object) {
        object.write(path).map_err(TurnError::from)?;
    }
    say(
        arguments,
        &figures,
        &solved,
        start.elapsed().as_secs_f64(),
        console,
    );
    warn_of(&solved, console);
    Ok(if solved.is_whole() {
        Outcome::Whole
    } else {
        Outcome::Incomplete
    })
}

/// Refuses places that cannot be written, before the work.
fn check_destinations(arguments: &Arguments) -> Result<AssetDestination<'_>, Box<dyn Error>> {
    let destinations = Destinations {
        output: &arguments.output,
        asset: arguments.asset.as_deref(),
        has_movie: !arguments.no_video,
    };
    destinations.check().map_err(|error| match error {
        DestinationError::AssetPlace { .. } => format!("--asset {error}").into(),
        error => error.into(),
    })
}

fn solve(arguments: &Arguments, console: Console) -> Result<SolvedTurn, Box<dyn Error>> {
    let bar = console.progress(0, "frames");
    let solved = solve_turn(
        &arguments.shard,
        &arguments.options()?,
        &arguments.networks()?,
        &|done, all| {
            bar.set_length(all);
            bar.set_position(done);
        },
    )?;
    bar.finish_and_clear();
    Ok(solved)
}

/// Where the light is from; none where it is to be found.
fn light_source(arguments: &Arguments, ball: Option<&ProbeLight>) -> Option<String> {
    let given = arguments.light.as_ref();
    let given = given.map(|path| path.display().to_string());
    given.or_else(|| ball.map(|measured| format!("probe, {}", measured.ball)))
}

/// Says how it came out.
fn say(
    arguments: &Arguments,
    figures: &TurnFigures,
    solved: &SolvedTurn,
    seconds: f64,
    console: Console,
) {
    let reading_seconds = solved.reading.as_secs_f64();
    let text = format!(
        "{}: {} frames over {:.0} degrees in {reading_seconds:.1} s, all in {seconds:.1} s; normals expected within {:.0} degrees \
         (median), light {}, material {}",
        arguments.output.display(),
        figures.frames(),
        figures.coverage_deg(),
        solved.solution.expected_error_deg(),
        match (&arguments.light, &solved.ball) {
            (Some(_), _) => "given",
            (None, Some(_)) => "measured",
            (None, None) => "found",
        },
        solved.solution.material(),
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
