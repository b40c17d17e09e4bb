//! Normals and albedo of a turn by the network, in unknown light.

use relight_core::image::{Linear, Planes, Rgb};
use relight_core::light::Normals;
use relight_photo::nets::{Inference, NetError, Weights, turn_network};
use serde::Serialize;

use crate::model::frame::Elevation;
use crate::network::crop::{Crop, GRID, mean_light};
use crate::network::input::{log_means, network_input};
use crate::observe::curves::TurnCurves;

/// The network of turns with its weights.
#[derive(Debug)]
pub struct TurnNetwork {
    plan: Inference,
}

/// The network's answer for a turn.
#[derive(Debug, Clone)]
pub(crate) struct TurnPrediction {
    /// Unit normals under the mask.
    pub(crate) normals: Normals,
    /// By how much each is expected to be off, degrees; 0 outside the mask.
    pub(crate) expected_errors: Planes<1>,
    /// Albedo, each channel in a unit of its own.
    pub(crate) albedo: Rgb<Linear>,
    /// The means of these errors.
    pub(crate) figures: NetworkFigures,
}

/// The mean errors that the network expects of a turn, degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct NetworkFigures {
    /// Of its answer.
    pub(crate) expected_error_deg: f32,
    /// The one if the table turned the other way.
    pub(crate) other_direction_deg: f32,
}

/// Largest part of one direction's expected error with which the other direction is taken to be right. Measured: on 36
/// synthetic turns it never takes the wrong one, and none on three (docs/results/turns.md).
const CLEARLY: f32 = 0.9;

impl NetworkFigures {
    /// Whether the table clearly looks as if it turned this way.
    pub(crate) fn is_direction_sure(self) -> bool {
        self.expected_error_deg < CLEARLY * self.other_direction_deg
    }

    /// Whether the table looks as if it turned the other way.
    pub(crate) fn is_direction_doubted(self) -> bool {
        self.other_direction_deg < CLEARLY * self.expected_error_deg
    }
}

/// Range of the logarithm of the expected chord: 1 degree to the maximum.
const LOG_CHORD: (f32, f32) = (-4.0, 0.7);

/// A normal and its expected error.
#[derive(Debug, Clone, Copy, PartialEq)]
struct NetworkNormal {
    /// Unit length, in the viewer's frame; it faces the viewer.
    normal: [f32; 3],
    /// By how much it is expected to be off, degrees.
    expected_error_deg: f32,
}

impl NetworkNormal {
    /// The normal of a pixel's four numbers.
    fn from_output([x, y, z, log_chord]: [f32; 4]) -> Self {
        let length = (x * x + y * y + z * z).sqrt();
        let normal = if length > 1e-9 && length.is_finite() {
            [x / length, y / length, z / length]
        } else {
            [0.0, 0.0, 1.0]
        };
        let chord = log_chord.clamp(LOG_CHORD.0, LOG_CHORD.1).exp();
        Self {
            normal,
            expected_error_deg: 2.0 * (chord / 2.0).min(1.0).asin().to_degrees(),
        }
    }
}

/// The network's answer for a cell: the normal, the logarithm of its expected chord, and that of albedo over the curve's mean.
type Cell = [f32; 7];

type Cells = Vec<Option<Cell>>;

impl TurnNetwork {
    /// The network with these weights.
    ///
    /// # Errors
    /// [`NetError`] if they are another network's.
    pub fn new(weights: &Weights) -> Result<Self, NetError> {
        let plan = Inference::new(&turn_network(), weights, (GRID, GRID))?;
        Ok(Self { plan })
    }

    /// Normals and their expected errors, averaged over the turn and its mirror image.
    ///
    /// # Errors
    /// [`NetError`] if the network fails.
    pub(crate) fn predict(
        &self,
        curves: &TurnCurves,
        elevation: Elevation,
    ) -> Result<TurnPrediction, NetError> {
        let crop = Crop::new(curves);
        let other = Crop::new(&curves.with_other_direction());
        let elevation = elevation.degrees().to_radians() as f32;
        let ((seen, in_mirror), other) = rayon::join(
            || {
                rayon::join(
                    || self.cells(&crop, elevation),
                    || self.cells(&crop.mirrored(), elevation),
                )
            },
            || self.cells(&other, elevation),
        );
        let seen = seen?;
        let figures = NetworkFigures {
            expected_error_deg: mean_error(&seen),
            other_direction_deg: mean_error(&other?),
        };
        let cells = mean_of_looks(&seen, &in_mirror?);
        Ok(spread(curves, &crop, &cells, figures))
    }

    fn cells(&self, crop: &Crop, elevation: f32) -> Result<Cells, NetError> {
        let input = network_input(&crop.turn(elevation));
        let predictions = self.plan.run(&input)?;
        let area = GRID * GRID;
        let value = |output: usize, channel: usize, at: usize| {
            let values = predictions
                .get(output)
                .map(|prediction| prediction.values());
            let value = values.and_then(|values| values.get(channel * area + at));
            value.copied().filter(|value| value.is_finite())
        };
        let mut cells = vec![None; area];
        for &pixel in crop.pixels() {
            let at = pixel as usize;
            let prediction = [0, 1, 2, 3].map(|c| value(0, c, at).unwrap_or(0.0));
            let [x, y, z] = NetworkNormal::from_output(prediction).normal;
            let [r, g, b] = [0, 1, 2].map(|c| value(1, c, at).unwrap_or(0.0));
            cells[at] = Some([x, y, z, prediction[3], r, g, b]);
        }
        Ok(cells)
    }
}

/// The mean of the network's answers for a turn and for its mirror image.
fn mean_of_looks(seen: &Cells, in_mirror: &Cells) -> Cells {
    (0..GRID * GRID)
        .map(|at| {
            let mirrored = at / GRID * GRID + (GRID - 1 - at % GRID);
            let one = seen[at]?;
            let Some(other) = in_mirror[mirrored] else {
                return Some(one);
            };
            let sign = |i: usize| if i == 0 { -1.0 } else { 1.0 };
            Some(std::array::from_fn(|i| (one[i] + sign(i) * other[i]) / 2.0))
        })
        .collect()
}

fn mean_error(cells: &Cells) -> f32 {
    let errors = cells.iter().flatten().map(|&[x, y, z, chord, ..]| {
        NetworkNormal::from_output([x, y, z, chord]).expected_error_deg
    });
    let (sum, count) = errors.fold((0.0, 0.0), |(sum, count), error| (sum + error, count + 1.0));
    sum / f32::max(count, 1.0)
}

/// The cells as maps of the frame.
fn spread(
    curves: &TurnCurves,
    crop: &Crop,
    cells: &Cells,
    figures: NetworkFigures,
) -> TurnPrediction {
    let width = curves.extent().width;
    let places = curves.places().iter();
    let predictions: Vec<Cell> = places
        .map(|&place| crop.at(cells, place % width, place / width))
        .map(|prediction| prediction.unwrap_or([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]))
        .collect();
    let normal = |&[x, y, z, chord, ..]: &Cell| NetworkNormal::from_output([x, y, z, chord]);
    // What the network adds is smooth, so that the albedo is as fine as the frame.
    let albedo: Vec<[f32; 3]> = (predictions.iter().zip(log_means(&mean_light(curves))))
        .map(|(more, mean)| [0, 1, 2].map(|c| (mean[c] + more[4 + c]).exp()))
        .collect();
    let predictions: Vec<NetworkNormal> = predictions.iter().map(normal).collect();
    TurnPrediction {
        normals: Normals::new(curves.map(|pixel| predictions[pixel].normal)),
        expected_errors: curves.map(|pixel| [predictions[pixel].expected_error_deg]),
        albedo: Rgb::new(curves.map(|pixel| albedo[pixel])),
        figures,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_becomes_a_unit_normal_with_its_chord_as_an_angle() {
        let found = NetworkNormal::from_output([0.0, 3.0, 4.0, 0.2_f32.ln()]);
        assert_eq!(found.normal, [0.0, 0.6, 0.8]);
        assert!((found.expected_error_deg - 11.48).abs() < 0.01);
        let nothing = NetworkNormal::from_output([0.0, f32::NAN, 0.0, 0.0]);
        assert_eq!(nothing.normal, [0.0, 0.0, 1.0]);
    }
}
