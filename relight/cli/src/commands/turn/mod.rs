//! `relight turn`: a whole turn into normals, albedo and light.

mod arguments;

use std::error::Error;
use std::time::Instant;

use relight_turn::{SolvedTurn, TurnFiles, solve_turn};
use relit_console::{Console, Outcome};
use serde_json::json;

pub(crate) use self::arguments::{Arguments, EXAMPLES};
use crate::commands::CommandResult;

pub(crate) fn run(arguments: &Arguments, console: Console) -> CommandResult {
    let start = Instant::now();
    TurnFiles::check(&arguments.folder.output)?;
    let solved = solve(arguments, console)?;
    let figures = TurnFiles {
        solved: &solved,
        light_source: light_source(arguments, &solved).as_deref(),
    }
    .write(&arguments.folder.output)?;
    let (seconds, reading_seconds) = (start.elapsed().as_secs_f64(), solved.reading.as_secs_f64());
    let text = text(arguments, &solved, [reading_seconds, seconds]);
    let event = json!({
        "event": "turned",
        "output": arguments.folder.output,
        "seconds": seconds,
        "reading_seconds": reading_seconds,
        "figures": figures,
    });
    console.print(&text, &event);
    for warning in solved.warnings() {
        console.warn(&warning);
    }
    Ok(if solved.is_whole() {
        Outcome::Success
    } else {
        Outcome::Partial
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

/// The source of the light; `None` if it is to be estimated.
fn light_source(arguments: &Arguments, solved: &SolvedTurn) -> Option<String> {
    let given = arguments.light.as_ref();
    let given = given.map(|path| path.display().to_string());
    let measured = solved.ball.as_ref();
    given.or_else(|| measured.map(|measured| format!("probe, {}", measured.ball)))
}

/// The result, in words.
fn text(arguments: &Arguments, solved: &SolvedTurn, [reading, all]: [f64; 2]) -> String {
    format!(
        "{}: {} frames over {:.0} degrees in {reading:.1} s, {all:.1} s in total; normals expected within {:.0} degrees \
         (median), light {}, material {}",
        arguments.folder.output.display(),
        solved.turn.curves.frames(),
        solved.turn.curves.coverage_deg(),
        solved.solution.expected_error_deg(),
        match (&arguments.light, &solved.ball) {
            (Some(_), _) => "given",
            (None, Some(_)) => "measured",
            (None, None) => "found",
        },
        solved.solution.material(),
    )
}
