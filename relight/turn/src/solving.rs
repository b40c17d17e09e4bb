//! A turn from its shard to normals, albedo and light.

use std::path::Path;
use std::time::{Duration, Instant};

use relight_core::light::ShLight;
use relight_photo::nets::Weights;
use relit_data::rig::{RigFacts, RotationDirection};
use relit_data::session::Recording;

use crate::error::TurnError;
use crate::fit::known_light::solve_in_light;
use crate::fit::photo_albedo::photo_albedo;
use crate::fit::probe_light::ProbeLight;
use crate::fit::solution::TurnSolution;
use crate::fit::unknown_light::solve_by_network;
use crate::model::frame::{Elevation, FactSource};
use crate::model::material::MaterialKind;
use crate::network::predict::{NetworkFigures, TurnNetwork, TurnPrediction};
use crate::observe::origin::{dataset_of, recording_of, session_of};
use crate::observe::probe::{Probe, ProbeBall};
use crate::observe::probe_place::ProbePlace;
use crate::observe::reading::{ReadTurn, TableRotation, read_curves};
use crate::observe::video_probe::probe_from_video;

/// What is known of a turn beforehand.
#[derive(Debug, Clone, Default)]
pub struct TurnOptions<'a> {
    /// Which way the table turns as its angle grows. Where it is not given, it is that of the rig in `dataset.json` or
    /// `session.json`, else the one in which the network of turns is clearly surer, else the usual one.
    pub rotation: Option<RotationDirection>,
    /// The camera over the table; that of the rig, or what is usual, where it is not given.
    pub elevation: Option<Elevation>,
    /// The light.
    pub light: TurnLight<'a>,
    /// The material.
    pub material: MaterialKind,
}

/// What is known of the light of a turn.
#[derive(Debug, Clone, Default)]
pub enum TurnLight<'a> {
    /// Nothing.
    #[default]
    Unknown,
    /// It was measured: in the viewer's frame at the table's angle 0.
    Given(ShLight),
    /// A ball on the table measures it.
    Ball {
        /// The session of the turn, or its video; looked for by `dataset.json` where it is not given.
        session: Option<&'a Path>,
        /// Where the ball is in the video.
        place: ProbePlace,
        /// What it is made of; what it looks like where that is not known.
        ball: Option<ProbeBall>,
    },
}

/// The networks that turns are solved with.
#[derive(Debug)]
pub struct TurnNetworks {
    /// That which sees the whole turn.
    pub turn: TurnNetwork,
    /// The weights of that which sees single frames.
    pub photo: Weights,
}

/// A turn, and what was found of it.
#[derive(Debug)]
pub struct SolvedTurn {
    /// What was read.
    pub turn: ReadTurn,
    /// Normals, albedo and light.
    pub solution: TurnSolution,
    /// What the network of turns expects of its normals.
    pub(crate) network: NetworkFigures,
    /// The light by the ball, where there is one.
    pub ball: Option<ProbeLight>,
    /// How long the shard took to read.
    pub reading: Duration,
}

/// Solves the turn of a shard, or of what else [`read_curves`] takes. `progress` is told how many frames of the
/// shard, and then of the video, are done, and how many there are.
///
/// # Errors
/// Where the shard or the video cannot be read, a network fails, or no light fits the turn.
pub fn solve_turn(
    shard: &Path,
    options: &TurnOptions<'_>,
    networks: &TurnNetworks,
    progress: &dyn Fn(u64, u64),
) -> Result<SolvedTurn, TurnError> {
    let recording = match &options.light {
        TurnLight::Ball {
            session: Some(given),
            ..
        } => Some(Recording::open(given)?),
        TurnLight::Ball { session: None, .. } => Some(recording_of(shard)?),
        TurnLight::Unknown | TurnLight::Given(_) => None,
    };
    let rig = rig_of(shard, recording.as_ref());
    let elevation = match (options.elevation, rig.camera_elevation_deg) {
        (Some(given), _) => given,
        (None, Some(degrees)) => Elevation::from_rig(degrees)?,
        (None, None) => Elevation::assumed(),
    };
    let start = Instant::now();
    let turn = read_curves(shard, rotation(options, rig), progress)?;
    let reading = start.elapsed();
    let (turn, prediction) = predict(turn, elevation, &networks.turn)?;
    let ball = match (&options.light, &recording) {
        (&TurnLight::Ball { place, ball, .. }, Some(recording)) => {
            let probe = Probe {
                place,
                ball,
                elevation,
            };
            Some(probe_from_video(recording, &turn, probe, progress)?.finish()?)
        }
        _ => None,
    };
    let given = match &options.light {
        TurnLight::Given(light) => Some(light),
        TurnLight::Ball { .. } | TurnLight::Unknown => ball.as_ref().map(|ball| &ball.light),
    };
    let solution = match given {
        Some(light) => solve_in_light(&turn.curves, light, elevation, options.material),
        None => {
            let seen = photo_albedo(&networks.photo, &turn.first, &turn.mask)?;
            solve_by_network(
                &turn.curves,
                &prediction,
                &seen,
                elevation,
                options.material,
            )?
        }
    };
    Ok(SolvedTurn {
        turn,
        solution,
        network: prediction.figures,
        ball,
        reading,
    })
}

/// What is known of the rig: by the data set of the shard, else by the session.
fn rig_of(shard: &Path, recording: Option<&Recording>) -> RigFacts {
    let of_session = || recording?.manifest.as_ref()?.rig;
    rig_of_dataset(shard)
        .or_else(of_session)
        .unwrap_or_default()
}

fn rig_of_dataset(shard: &Path) -> Option<RigFacts> {
    let (dataset, _) = dataset_of(shard)?;
    session_of(&dataset, shard)?.rig
}

fn rotation(options: &TurnOptions<'_>, rig: RigFacts) -> TableRotation {
    let known = |direction, source| TableRotation { direction, source };
    match (options.rotation, rig.rotation) {
        (Some(given), _) => known(given, FactSource::Given),
        (None, Some(direction)) => known(direction, FactSource::Rig),
        (None, None) => TableRotation::default(),
    }
}

/// What the network of turns says of a turn, in the other rotation direction where nobody knows it and the network is clearly
/// surer of that one.
fn predict(
    mut turn: ReadTurn,
    elevation: Elevation,
    network: &TurnNetwork,
) -> Result<(ReadTurn, TurnPrediction), TurnError> {
    let prediction = network.predict(&turn.curves, elevation)?;
    if turn.rotation.source != FactSource::Assumed {
        return Ok((turn, prediction));
    }
    if prediction.figures.is_direction_doubted() {
        let turn = turn.turned_other_way(FactSource::Network);
        let prediction = network.predict(&turn.curves, elevation)?;
        return Ok((turn, prediction));
    }
    if prediction.figures.is_direction_sure() {
        turn.rotation.source = FactSource::Network;
    }
    Ok((turn, prediction))
}
