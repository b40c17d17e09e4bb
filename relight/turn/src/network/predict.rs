//! Normals and albedo of a turn by the network, in an unknown room.

use rayon::prelude::*;
use relight_core::image::{Linear, Planes, Rgb};
use relight_core::light::{Normals, YUp};
use relight_photo::nets::{Inference, NetError, Weights, turn_network};
use serde::Serialize;

use crate::model::frame::Elevation;
use crate::network::answer::NetworkNormal;
use crate::network::crop::{Crop, GRID, mean_light};
use crate::network::input::{PhaseHypothesis, log_means, network_input};
use crate::observe::curves::TurnCurves;

/// The network of turns with its weights.
#[derive(Debug)]
pub struct TurnNetwork {
    plan: Inference,
}

/// What the network says of a turn.
#[derive(Debug, Clone)]
pub struct TurnPrediction {
    /// Unit normals under the mask.
    pub normals: Normals<YUp>,
    /// By how much each is expected to be off, degrees; 0 outside the mask.
    pub expected_errors: Planes<1>,
    /// Albedo, each channel in a unit of its own.
    pub albedo: Rgb<Linear>,
    /// What it was taken for, and what else was looked at.
    pub hypotheses: HypothesisFigures,
}

/// What the network takes a turn for, by the mean error that it expects, degrees.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HypothesisFigures {
    /// Which way the room was taken to be turned: the phase with the least expected error.
    pub phase: PhaseHypothesis,
    /// Every phase that was looked at.
    pub phases: Vec<PhaseFigure>,
    /// The least expected error if the table turned the other way.
    pub other_direction_deg: f32,
}

/// A phase and the mean error that is expected with it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PhaseFigure {
    /// The phase.
    pub phase: PhaseHypothesis,
    /// Degrees.
    pub expected_error_deg: f32,
}

/// Largest part of one direction's expected error with which the other direction is taken to be right. Measured: on 40
/// synthetic turns the wrong direction has 0.99 to 2.8 times the expected error of the right one (docs/results/turns.md).
const CLEARLY: f32 = 0.9;

impl HypothesisFigures {
    /// The mean error that is expected of the answer, degrees.
    #[must_use]
    pub fn expected_error_deg(&self) -> f32 {
        let taken = self.phases.iter().find(|figure| figure.phase == self.phase);
        taken.map_or(f32::INFINITY, |figure| figure.expected_error_deg)
    }

    /// Whether the table clearly looks as if it turned this way.
    #[must_use]
    pub fn is_direction_sure(&self) -> bool {
        self.expected_error_deg() < CLEARLY * self.other_direction_deg
    }

    /// Whether the table looks as if it turned the other way.
    #[must_use]
    pub fn is_direction_doubted(&self) -> bool {
        self.other_direction_deg < CLEARLY * self.expected_error_deg()
    }
}

/// What the network says of a cell.
#[derive(Debug, Clone, Copy)]
struct Cell {
    /// The normal and the logarithm of its expected chord.
    normal: [f32; 4],
    /// The logarithm of albedo over the curve's mean.
    albedo: [f32; 3],
}

type Cells = Vec<Option<Cell>>;

impl TurnNetwork {
    /// The network with these weights.
    ///
    /// # Errors
    /// [`NetError`] where they are another network's.
    pub fn new(weights: &Weights) -> Result<Self, NetError> {
        let plan = Inference::new(&turn_network(), weights, (GRID, GRID))?;
        Ok(Self { plan })
    }

    /// Normals and what they are expected to be off by. Of the hypotheses of the light's phase that with the least
    /// expected error is taken, and of it the mean of what is said of the turn and of its mirror image.
    ///
    /// # Errors
    /// [`NetError`] where the network fails.
    pub fn predict(
        &self,
        curves: &TurnCurves,
        elevation: Elevation,
    ) -> Result<TurnPrediction, NetError> {
        let crop = Crop::new(curves);
        let elevation = elevation.degrees().to_radians() as f32;
        let looks = self.looks(&crop, elevation)?;
        let others = self.looks(&Crop::new(&curves.with_other_direction()), elevation)?;
        let phases = looks
            .iter()
            .map(|&(phase, expected_error_deg, _)| PhaseFigure {
                phase,
                expected_error_deg,
            })
            .collect();
        let other_direction_deg = others
            .iter()
            .map(|(_, error, _)| *error)
            .fold(f32::INFINITY, f32::min);
        let best = looks.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
        let (phase, cells) = match best {
            Some((phase, _, seen)) => {
                let in_mirror = self.cells(&crop.mirrored(), elevation, phase.in_mirror())?;
                (phase, mean_of_looks(&seen, &in_mirror))
            }
            None => (PhaseHypothesis::First, vec![None; GRID * GRID]),
        };
        let hypotheses = HypothesisFigures {
            phase,
            phases,
            other_direction_deg,
        };
        Ok(spread(curves, &crop, &cells, hypotheses))
    }

    /// What the network says with every phase, and the mean error that it expects.
    fn looks(
        &self,
        crop: &Crop,
        elevation: f32,
    ) -> Result<Vec<(PhaseHypothesis, f32, Cells)>, NetError> {
        PhaseHypothesis::ALL
            .into_par_iter()
            .map(|phase| {
                let cells = self.cells(crop, elevation, phase)?;
                Ok((phase, mean_error(&cells), cells))
            })
            .collect()
    }

    fn cells(
        &self,
        crop: &Crop,
        elevation: f32,
        phase: PhaseHypothesis,
    ) -> Result<Cells, NetError> {
        let input = network_input(&crop.turn(elevation), phase);
        let answers = self.plan.run(&input)?;
        let area = GRID * GRID;
        let value = |output: usize, channel: usize, at: usize| {
            let values = answers.get(output).map(|answer| answer.values());
            let value = values.and_then(|values| values.get(channel * area + at));
            value.copied().filter(|value| value.is_finite())
        };
        let mut cells = vec![None; area];
        for &pixel in crop.pixels() {
            let at = pixel as usize;
            let answer = [0, 1, 2, 3].map(|c| value(0, c, at).unwrap_or(0.0));
            let [x, y, z] = NetworkNormal::of_answer(answer).normal;
            cells[at] = Some(Cell {
                normal: [x, y, z, answer[3]],
                albedo: [0, 1, 2].map(|c| value(1, c, at).unwrap_or(0.0)),
            });
        }
        Ok(cells)
    }
}

/// The mean of what the network says of a turn and of its mirror image.
fn mean_of_looks(seen: &Cells, in_mirror: &Cells) -> Cells {
    (0..GRID * GRID)
        .map(|at| {
            let mirrored = at / GRID * GRID + (GRID - 1 - at % GRID);
            let one = seen[at]?;
            let Some(other) = in_mirror[mirrored] else {
                return Some(one);
            };
            let ([x, y, z, error], [x2, y2, z2, error2]) = (one.normal, other.normal);
            Some(Cell {
                normal: [x - x2, y + y2, z + z2, (error + error2) / 2.0],
                albedo: [0, 1, 2].map(|c| (one.albedo[c] + other.albedo[c]) / 2.0),
            })
        })
        .collect()
}

fn mean_error(cells: &Cells) -> f32 {
    let errors = cells
        .iter()
        .flatten()
        .map(|cell| NetworkNormal::of_answer(cell.normal).expected_error_deg);
    let (sum, count) = errors.fold((0.0, 0.0), |(sum, count), error| (sum + error, count + 1.0));
    sum / f32::max(count, 1.0)
}

/// The cells as maps of the frame.
fn spread(
    curves: &TurnCurves,
    crop: &Crop,
    cells: &Cells,
    hypotheses: HypothesisFigures,
) -> TurnPrediction {
    let normals: Vec<Option<[f32; 4]>> = cells
        .iter()
        .map(|cell| Some(cell.as_ref()?.normal))
        .collect();
    let albedo: Vec<Option<[f32; 3]>> = cells
        .iter()
        .map(|cell| Some(cell.as_ref()?.albedo))
        .collect();
    let width = curves.extent().width;
    let places = || {
        curves
            .places()
            .iter()
            .map(|&place| (place % width, place / width))
    };
    let answers: Vec<NetworkNormal> = places()
        .map(|(x, y)| {
            let answer = crop.at(&normals, x, y);
            NetworkNormal::of_answer(answer.unwrap_or([0.0, 0.0, 1.0, 0.0]))
        })
        .collect();
    // What the network adds is smooth, so that the albedo is as fine as the frame.
    let albedo: Vec<[f32; 3]> = places()
        .zip(log_means(&mean_light(curves)))
        .map(|((x, y), mean)| {
            let more = crop.at(&albedo, x, y).unwrap_or_default();
            [0, 1, 2].map(|c| (mean[c] + more[c]).exp())
        })
        .collect();
    TurnPrediction {
        normals: Normals::new(curves.map(|pixel| answers[pixel].normal)),
        expected_errors: curves.map(|pixel| [answers[pixel].expected_error_deg]),
        albedo: Rgb::new(curves.map(|pixel| albedo[pixel])),
        hypotheses,
    }
}
