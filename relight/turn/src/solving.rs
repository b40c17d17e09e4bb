//! A turn from its shard to normals, albedo and light.

use std::path::Path;
use std::time::{Duration, Instant};

use relight_core::light::ShLight;
use relight_photo::nets::Weights;
use relit_data::rig::{RigFacts, RotationDirection};
use relit_data::session::Recording;
use relit_data::shard::SessionEntry;

use crate::error::TurnError;
use crate::fit::by_network::solve_by_network;
use crate::fit::photo_albedo::photo_albedo;
use crate::fit::probe_light::ProbeLight;
use crate::fit::solution::TurnSolution;
use crate::model::frame::{Elevation, FactSource};
use crate::model::material::MaterialKind;
use crate::network::predict::{NetworkFigures, TurnNetwork, TurnPrediction};
use crate::observe::origin::{dataset_of, recording_of, session_of};
use crate::observe::probe::{Probe, ProbeBall};
use crate::observe::probe_place::ProbePlace;
use crate::observe::reading::{ReadTurn, TableRotation, read_curves};
use crate::observe::video_probe::probe_from_video;

/// What is known about a turn beforehand.
#[derive(Debug, Clone, Default)]
pub struct TurnOptions<'a> {
    /// Which way the table turns as its angle grows. Where it is not given, it is that of the rig in `dataset.json` or
    /// `session.json`, else the one with clearly smaller expected errors of the network, else the usual one.
    pub rotation: Option<RotationDirection>,
    /// The camera over the table; by default that of the rig, or the usual one.
    pub elevation: Option<Elevation>,
    /// The light.
    pub light: TurnLight<'a>,
    /// The material.
    pub material: MaterialKind,
}

/// What is known about the light of a turn.
#[derive(Debug, Clone, Default)]
pub enum TurnLight<'a> {
    /// Nothing.
    #[default]
    Unknown,
    /// It was measured: in the viewer's frame at the table's angle 0.
    Given(ShLight),
    /// A ball on the table measures it.
    Ball {
        /// The session of the turn, or its video; by default as named in `dataset.json`.
        session: Option<&'a Path>,
        /// Where the ball is in the video.
        place: ProbePlace,
        /// Its material; by default as it looks.
        ball: Option<ProbeBall>,
    },
}

/// The networks that turns are solved with.
#[derive(Debug)]
pub struct TurnNetworks {
    /// The network of turns.
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
    /// Why the data set says that the turn is broken, if it does.
    pub(crate) broken: Option<String>,
    /// How long the shard took to read.
    pub reading: Duration,
}

/// Solves the turn of a shard, or of another input of [`read_curves`]. `progress` is called with the number of frames
/// done and of all frames: first those of the shard, then those of the video.
///
/// # Errors
/// If the shard or the video cannot be read, a network fails, or no light fits the turn.
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
    let described = dataset_of(shard).and_then(|(dataset, _)| session_of(&dataset, shard).cloned());
    let broken = described.as_ref().filter(|session| session.is_broken());
    let broken = broken.map(|session| session.quality.reasons.join("; "));
    let rig = rig_of(described.as_ref(), recording.as_ref());
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
    let seen = photo_albedo(&networks.photo, &turn.first, &turn.mask)?;
    let facts = (elevation, options.material);
    let solution = solve_by_network(&turn.curves, &prediction, &seen, given, facts)?;
    Ok(SolvedTurn {
        turn,
        solution,
        network: prediction.figures,
        ball,
        broken,
        reading,
    })
}

/// The rig's properties: from the data set of the shard, else from the session.
fn rig_of(described: Option<&SessionEntry>, recording: Option<&Recording>) -> RigFacts {
    let of_dataset = described.and_then(|session| session.rig);
    let of_session = || recording?.manifest.as_ref()?.rig;
    of_dataset.or_else(of_session).unwrap_or_default()
}

fn rotation(options: &TurnOptions<'_>, rig: RigFacts) -> TableRotation {
    let known = |direction, source| TableRotation { direction, source };
    match (options.rotation, rig.rotation) {
        (Some(given), _) => known(given, FactSource::Given),
        (None, Some(direction)) => known(direction, FactSource::Rig),
        (None, None) => TableRotation::default(),
    }
}

/// The network's answer for a turn, in the other rotation direction if that is unknown and the network is clearly
/// more certain there.
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
