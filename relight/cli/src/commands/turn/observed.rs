//! A turn as `relight turn` sees it before it is solved: read with the right rotation direction, with what its video shows,
//! the elevation, and what networks say.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use relight_core::light::ShLight;
use relight_turn::{
    Elevation, Filmed, MaterialKind, ReadTurn, RotationDirection, StripFigures, TableRotation,
    TurnError, TurnNetwork, TurnOptions, TurnPrediction, TurnPrior, film, prior_albedo,
    prior_normals, read_curves, read_given_light, session_of,
};
use relit_console::Console;
use relit_data::causes::with_causes;

use super::arguments::{Arguments, InitialNormals};
use crate::shipped;

pub(super) struct Observed {
    pub(super) turn: ReadTurn,
    pub(super) filmed: Option<Filmed>,
    elevation: Elevation,
    /// None where normals come from elsewhere.
    prediction: Option<TurnPrediction>,
    /// How long the frames took to read.
    pub(super) reading_seconds: f64,
}

impl Observed {
    /// Reads the turn, and again where it turns the other way than is usual and nobody said which.
    pub(super) fn new(arguments: &Arguments, console: Console) -> Result<Self, Box<dyn Error>> {
        let network = arguments.turn_network()?;
        let read = |rotation, with_video| {
            Self::read(arguments, network.as_ref(), (rotation, with_video), console)
        };
        let mut seen = read(arguments.rotation(), true)?;
        let rotation = seen.rotation();
        if rotation.direction == seen.turn.rotation.direction {
            seen.turn.rotation = rotation;
            return Ok(seen);
        }
        // A video that could not be read was told of.
        read(rotation, seen.filmed.is_some())
    }

    fn read(
        arguments: &Arguments,
        network: Option<&TurnNetwork>,
        (rotation, with_video): (TableRotation, bool),
        console: Console,
    ) -> Result<Self, Box<dyn Error>> {
        let start = Instant::now();
        let turn = read_turn(arguments, rotation, console)?;
        let reading_seconds = start.elapsed().as_secs_f64();
        let filmed = if with_video {
            film_surroundings(arguments, &turn, console)?
        } else {
            None
        };
        let elevation = arguments.elevation(filmed.as_ref());
        let prediction = network.map(|network| network.predict(&turn.curves, elevation));
        Ok(Self {
            turn,
            filmed,
            elevation,
            prediction: prediction.transpose()?,
            reading_seconds,
        })
    }

    /// What is known of the surroundings by the background of the video.
    fn background(&self) -> Option<&StripFigures> {
        let strip = self.filmed.as_ref().and_then(Filmed::strip);
        strip.map(|strip| strip.figures())
    }

    /// What is known of the turn beforehand; `measured` is the light by the ball.
    pub(super) fn options(
        &self,
        arguments: &Arguments,
        measured: Option<ShLight>,
    ) -> Result<TurnOptions, Box<dyn Error>> {
        let normals = arguments.normals();
        let prior = normals.map(|(source, _)| self.prior(&source, arguments));
        Ok(TurnOptions {
            elevation: self.elevation,
            // Of a table that turns the other way it would be the mirrored azimuth.
            panorama: self
                .background()
                .filter(|strip| strip.direction == RotationDirection::CounterClockwise)
                .copied(),
            light: match &arguments.light {
                Some(path) => Some(read_given_light(path)?),
                None => measured,
            },
            prior: prior.transpose()?.flatten(),
            prior_weight: arguments.normals_weight,
            material: arguments.material.map(MaterialKind::from),
        })
    }

    /// Normals to start from.
    fn prior(
        &self,
        source: &InitialNormals,
        arguments: &Arguments,
    ) -> Result<Option<TurnPrior>, Box<dyn Error>> {
        let (shown, mask) = (&self.turn.first, &self.turn.mask);
        let prior: Option<TurnPrior> = match source {
            InitialNormals::Turn => self.prediction.clone().map(TurnPrior::from),
            InitialNormals::Photo(source) => {
                let y = arguments.normals_y;
                Some(prior_normals(source, shipped::weights, y, shown, mask)?.into())
            }
        };
        // In a light that is known, curves tell the albedo, and in its units.
        if arguments.light.is_some() || arguments.probe.is_some() {
            return Ok(prior.map(|prior| TurnPrior {
                albedo: None,
                ..prior
            }));
        }
        let seen = prior_albedo(&shipped::weights()?, shown, mask)?;
        Ok(prior.map(|prior| prior.with_albedo_of_photographs(seen, mask)))
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
