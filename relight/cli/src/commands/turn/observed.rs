//! A turn as `relight turn` sees it before it is solved: read with the right rotation direction, with what its video shows,
//! the elevation, and what the network of turns says.

use std::error::Error;
use std::path::Path;

use relight_turn::{
    Elevation, Filmed, ReadTurn, StripFigures, TableRotation, TurnError, TurnNetwork,
    TurnPrediction, film, read_curves, session_of,
};
use relit_console::Console;
use relit_data::causes::with_causes;

use super::arguments::Arguments;

pub(super) struct Observed {
    pub(super) turn: ReadTurn,
    pub(super) filmed: Option<Filmed>,
    pub(super) elevation: Elevation,
    /// None where normals come from elsewhere.
    pub(super) prediction: Option<TurnPrediction>,
}

impl Observed {
    /// Reads the turn, and again where it turns the other way than is usual and nobody said which.
    pub(super) fn new(arguments: &Arguments, console: Console) -> Result<Self, Box<dyn Error>> {
        let network = arguments.turn_network()?;
        let read = |rotation| Self::read(arguments, network.as_ref(), rotation, console);
        let mut seen = read(arguments.rotation())?;
        let rotation = seen.rotation();
        if rotation.direction == seen.turn.rotation.direction {
            seen.turn.rotation = rotation;
            return Ok(seen);
        }
        read(rotation)
    }

    fn read(
        arguments: &Arguments,
        network: Option<&TurnNetwork>,
        rotation: TableRotation,
        console: Console,
    ) -> Result<Self, Box<dyn Error>> {
        let turn = read_turn(arguments, rotation, console)?;
        let filmed = film_surroundings(arguments, &turn, console)?;
        let elevation = arguments.elevation(filmed.as_ref());
        let prediction = network.map(|network| network.predict(&turn.curves, elevation));
        Ok(Self {
            turn,
            filmed,
            elevation,
            prediction: prediction.transpose()?,
        })
    }

    /// What is known of the surroundings by the background of the video.
    pub(super) fn background(&self) -> Option<&StripFigures> {
        let strip = self.filmed.as_ref().and_then(Filmed::strip);
        strip.map(|strip| strip.figures())
    }

    fn rotation(&self) -> TableRotation {
        let network = self.prediction.as_ref().map(|found| &found.hypotheses);
        TableRotation::of_turn(&self.turn, self.background(), network)
    }
}

fn read_turn(
    arguments: &Arguments,
    rotation: TableRotation,
    console: Console,
) -> Result<ReadTurn, TurnError> {
    let bar = console.progress(0, "frames");
    let turn = read_curves(&arguments.shard, rotation, &|done, all| {
        bar.set_length(all);
        bar.set_position(done);
    })?;
    bar.finish_and_clear();
    Ok(turn)
}

/// What the session's video shows, where there is one.
fn film_surroundings(
    arguments: &Arguments,
    turn: &ReadTurn,
    console: Console,
) -> Result<Option<Filmed>, TurnError> {
    let bar = console.progress(0, "frames of the video");
    let filmed = |path: &Path| {
        film(path, turn, arguments.probe(), &|done, all| {
            bar.set_length(all);
            bar.set_position(done);
        })
    };
    if let Some(path) = &arguments.session {
        return filmed(path).map(Some);
    }
    if arguments.no_session {
        return Ok(None);
    }
    let Some(path) = session_of(&arguments.shard, turn) else {
        return Ok(None);
    };
    // Nobody asked for it: the turn is solved without.
    Ok(match filmed(&path) {
        Ok(found) => Some(found),
        Err(error) => {
            let text = with_causes(&error);
            console.warn(&format!(
                "the session {} beside the shard was left out: {text}",
                path.display()
            ));
            None
        }
    })
}
