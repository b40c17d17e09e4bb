//! Normals in a light that is known: the network's, moved to where the curves fit better.

use rayon::prelude::*;
use relight_core::image::Planes;
use relight_core::light::NormalEquations;
use relit_data::statistics::median;

use crate::fit::curve_statistics::{CurveStatistics, RotationEquations};
use crate::fit::smoothing::smoothed;
use crate::model::directions::{MIN_FACING, cross, dot, unit};
use crate::model::shading::ShadingModel;
use crate::observe::curves::TurnCurves;

/// Rounds of Gauss-Newton. Measured: more do not reduce the error.
const ROUNDS: usize = 4;
/// How much a curve counts beside the network, for a residual as large as its variation. Measured on 26 synthetic turns: not
/// better with 8 or 32.
const CURVE_WEIGHT: f64 = 16.0;
/// Residual of any curve, over its variation: shadows also change what a normal could explain. Measured: not better
/// with 0 or 0.2.
const MIN_RESIDUAL: f64 = 0.05;
/// Standard deviation of the surroundings that turn together, in widths of the frame. Measured: 0 and 1/32 are worse.
const REACH: f32 = 1.0 / 64.0;
/// Expected errors of the network that count, radians. By hand: 2 to 60 degrees.
const EXPECTED: [f64; 2] = [0.035, 1.05];
/// Largest rotation of a round, radians. Numerical.
const MAX_STEP: f64 = 0.35;
/// Rotation of the finite differences, radians. Numerical.
const STEP: f64 = 0.02;
/// The axes of rotations.
const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The network's normals, each turned by what explains the curves around it best: the less its own expected error, radians, and the
/// larger the residuals there, the less it turns.
///
/// Shadows that the model does not know bend the normals of single pixels, and the network errs on whole parts of an object:
/// so pixels turn with those around them.
pub(crate) fn refined(
    curves: &TurnCurves,
    statistics: &[CurveStatistics],
    model: &ShadingModel,
    network: &[[f64; 3]],
    expected_errors: &[f64],
) -> Vec<[f64; 3]> {
    let mut normals = network.to_vec();
    for _ in 0..ROUNDS {
        let shown: Vec<RotationEquations> = (normals.par_iter().zip(statistics))
            .map(|(&normal, statistics)| rotation_equations(model, statistics, normal))
            .collect();
        let typical = median(shown.iter().map(|shown| shown.residual)).unwrap_or(0.0);
        let sums = curves.map(|pixel| {
            let shown = &shown[pixel];
            let by_curve = CURVE_WEIGHT / (typical + shown.residual + MIN_RESIDUAL);
            let [least, most] = EXPECTED;
            let by_network = 2.0 / expected_errors[pixel].clamp(least, most).powi(2);
            let back = cross(normals[pixel], network[pixel]);
            let diagonal = [by_network, 0.0, by_network, 0.0, 0.0, by_network];
            std::array::from_fn::<f32, 9, _>(|i| {
                let network = match i {
                    0..6 => diagonal[i],
                    _ => by_network * back[i - 6],
                };
                let curve = match i {
                    0..6 => shown.products[i],
                    _ => shown.right[i - 6],
                };
                (by_curve * curve + network) as f32
            })
        });
        let sums: Planes<9> = smoothed(&sums, REACH * curves.extent().width as f32);
        let sums: Vec<[f64; 9]> = curves.pixels_of(&sums).collect();
        normals
            .par_iter_mut()
            .zip(&sums)
            .for_each(|(normal, sums)| *normal = turned(*normal, rotation(sums)));
    }
    normals
}

/// How a curve changes as its normal turns.
fn rotation_equations(
    model: &ShadingModel,
    statistics: &CurveStatistics,
    normal: [f64; 3],
) -> RotationEquations {
    let shown = model.harmonics(normal);
    let turned = AXES.map(|axis| model.harmonics(turned(normal, axis.map(|part| STEP * part))));
    statistics.rotation_equations(&shown, &turned, STEP)
}

/// The rotation that the equations' sums say, no larger than one round may turn.
fn rotation(sums: &[f64; 9]) -> [f64; 3] {
    let mut equations = NormalEquations::new(3);
    equations.add_sums(
        |i, j| sums[i * (i + 1) / 2 + j],
        |i| [sums[6 + i], 0.0, 0.0],
    );
    let solved = equations.solve().unwrap_or_default();
    let mut rotation = [0.0; 3];
    for (part, [value, ..]) in rotation.iter_mut().zip(solved) {
        *part = value;
    }
    let angle = dot(rotation, rotation).sqrt();
    let part = (MAX_STEP / angle.max(1e-12)).min(1.0);
    rotation.map(|value| part * value)
}

/// A normal after a small rotation, as far as it faces the viewer.
fn turned(normal: [f64; 3], rotation: [f64; 3]) -> [f64; 3] {
    let moved = cross(rotation, normal);
    let [x, y, z] = unit([0, 1, 2].map(|i| normal[i] + moved[i]));
    unit([x, y, z.max(MIN_FACING)])
}
