//! Normals of a turn by the network, in an unknown room.

use rayon::prelude::*;
use relight_core::image::Planes;
use relight_core::light::{Normals, YUp};
use relight_nets::{Inference, NetError, Weights, turn_network};

use crate::model::frame::Elevation;
use crate::network::answer::NetworkNormal;
use crate::network::crop::{Crop, GRID};
use crate::network::input::{PhaseHypothesis, network_input};
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
    /// Which way the room was taken to be turned.
    pub phase: PhaseHypothesis,
    /// The mean expected error of every hypothesis that was looked at, degrees.
    pub hypotheses: Vec<(PhaseHypothesis, f32)>,
}

/// A cell's normal and the logarithm of its expected chord.
type Cells = Vec<Option<[f32; 4]>>;

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
        let looks: Vec<(PhaseHypothesis, f32, Cells)> = PhaseHypothesis::ALL
            .into_par_iter()
            .map(|phase| {
                let cells = self.cells(&crop, elevation, phase)?;
                Ok((phase, mean_error(&cells), cells))
            })
            .collect::<Result<_, NetError>>()?;
        let hypotheses = looks
            .iter()
            .map(|(phase, error, _)| (*phase, *error))
            .collect();
        let best = looks.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
        let (phase, cells) = match best {
            Some((phase, _, seen)) => {
                let in_mirror = self.cells(&crop.mirrored(), elevation, phase.in_mirror())?;
                (phase, mean_of_looks(&seen, &in_mirror))
            }
            None => (PhaseHypothesis::First, vec![None; GRID * GRID]),
        };
        Ok(spread(curves, &crop, &cells, phase, hypotheses))
    }

    fn cells(
        &self,
        crop: &Crop,
        elevation: f32,
        phase: PhaseHypothesis,
    ) -> Result<Cells, NetError> {
        let input = network_input(&crop.turn(elevation), phase);
        let answers = self.plan.run(&input)?;
        let values = answers.first().map_or(&[][..], |answer| answer.values());
        let area = GRID * GRID;
        let mut cells = vec![None; area];
        for &pixel in crop.pixels() {
            let at = pixel as usize;
            let answer = [0, 1, 2, 3].map(|c| values.get(c * area + at).copied().unwrap_or(0.0));
            let [x, y, z] = NetworkNormal::of_answer(answer).normal;
            cells[at] = Some([x, y, z, answer[3]]);
        }
        Ok(cells)
    }
}

/// The mean of what the network says of a turn and of its mirror image.
fn mean_of_looks(seen: &Cells, in_mirror: &Cells) -> Cells {
    (0..GRID * GRID)
        .map(|at| {
            let mirrored = at / GRID * GRID + (GRID - 1 - at % GRID);
            let [x, y, z, error] = seen[at]?;
            let Some([x2, y2, z2, error2]) = in_mirror[mirrored] else {
                return Some([x, y, z, error]);
            };
            Some([x - x2, y + y2, z + z2, (error + error2) / 2.0])
        })
        .collect()
}

fn mean_error(cells: &Cells) -> f32 {
    let errors = cells
        .iter()
        .flatten()
        .map(|&cell| NetworkNormal::of_answer(cell).expected_error_deg);
    let (sum, count) = errors.fold((0.0, 0.0), |(sum, count), error| (sum + error, count + 1.0));
    sum / f32::max(count, 1.0)
}

/// The cells as maps of the frame.
fn spread(
    curves: &TurnCurves,
    crop: &Crop,
    cells: &Cells,
    phase: PhaseHypothesis,
    hypotheses: Vec<(PhaseHypothesis, f32)>,
) -> TurnPrediction {
    let width = curves.extent().width;
    let answers: Vec<NetworkNormal> = curves
        .places()
        .iter()
        .map(|&place| {
            let answer = crop.at(cells, place % width, place / width);
            NetworkNormal::of_answer(answer.unwrap_or([0.0, 0.0, 1.0, 0.0]))
        })
        .collect();
    TurnPrediction {
        normals: Normals::new(curves.map(|pixel| answers[pixel].normal)),
        expected_errors: curves.map(|pixel| [answers[pixel].expected_error_deg]),
        phase,
        hypotheses,
    }
}
