//! Normals that initialise where nothing is known but the object's outline.

use relight_core::image::{Extent, Planes};

use crate::fit::smoothing::blurred;
use crate::model::directions::unit;
use crate::observe::curves::TurnCurves;

/// Parameters of the inflation.
struct InflationParameters {
    /// Steps of relaxation for each pixel of the longer side. Derived: over-relaxation needs a number in proportion to
    /// it.
    steps_a_pixel: usize,
}

const PARAMETERS: InflationParameters = InflationParameters { steps_a_pixel: 4 };

/// The normals of a round shape in the outline of the mask, one a pixel: the height is the root of the solution
/// of Poisson's equation that is 0 at the outline, times `height`. At the outline the normals lie in the image
/// plane, as those of every smooth shape do.
pub(crate) fn inflated(curves: &TurnCurves, height: f64) -> Vec<[f64; 3]> {
    let extent = curves.extent();
    let wide = Extent::new(extent.width + 2, extent.height + 2);
    let mut inside = vec![false; wide.pixels()];
    let at = |place: usize| (place / extent.width + 1) * wide.width + place % extent.width + 1;
    for &place in curves.places() {
        inside[at(place)] = true;
    }
    let poisson = relaxed(
        &inside,
        wide,
        PARAMETERS.steps_a_pixel * extent.width.max(extent.height),
    );
    let surface = Planes::from_fn(wide, |x, y| [poisson[y * wide.width + x].sqrt() as f32]);
    let surface = blurred(&surface, &vec![true; wide.pixels()], 1.0);
    let value = |place: usize| f64::from(surface.plane(0)[place]);
    curves
        .places()
        .iter()
        .map(|&place| {
            let here = at(place);
            let right = (value(here + 1) - value(here - 1)) / 2.0;
            let down = (value(here + wide.width) - value(here - wide.width)) / 2.0;
            unit([-height * right, height * down, 1.0])
        })
        .collect()
}

/// The solution of the Laplacian of u being -4 inside, and u 0 elsewhere, by over-relaxation.
fn relaxed(inside: &[bool], extent: Extent, steps: usize) -> Vec<f64> {
    let mut values = vec![0.0; extent.pixels()];
    let side = extent.width.max(extent.height) as f64;
    let factor = 2.0 / (1.0 + (std::f64::consts::PI / side).sin());
    for _ in 0..steps {
        for here in (0..values.len()).filter(|&here| inside[here]) {
            let beside = values[here - 1]
                + values[here + 1]
                + values[here - extent.width]
                + values[here + extent.width];
            values[here] += factor * (beside / 4.0 + 1.0 - values[here]);
        }
    }
    values.iter().map(|value| value.max(0.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CurveBuilder;

    /// A disc of this radius in the middle of a square image, over a few angles.
    fn disc(side: usize, radius: f32) -> TurnCurves {
        let extent = Extent::new(side, side);
        let middle = side as f32 / 2.0 - 0.5;
        let mask = Planes::from_fn(extent, |x, y| {
            let square = (x as f32 - middle).powi(2) + (y as f32 - middle).powi(2);
            [f32::from(u8::from(square < radius * radius))]
        });
        let mut builder = CurveBuilder::new(extent, mask.plane(0)).unwrap();
        let grey = vec![0.5; extent.pixels()];
        for k in 0..12 {
            builder
                .push(f64::from(k) * 30.0, extent, [&grey; 3])
                .unwrap();
        }
        builder.finish().unwrap()
    }

    #[test]
    fn a_disc_is_inflated_to_a_ball() {
        // With the Laplacian -4, u = radius² - r², whose root is the ball itself.
        let curves = disc(41, 18.0);
        let normals = inflated(&curves, 1.0);
        for (normal, &place) in normals.iter().zip(curves.places()) {
            let x = (place % 41) as f64 - 20.0;
            let y = 20.0 - (place / 41) as f64;
            if x.hypot(y) > 14.0 {
                continue;
            }
            let ball = unit([x, y, (18.0_f64.powi(2) - x * x - y * y).sqrt()]);
            let angle = crate::model::directions::dot(*normal, ball).min(1.0).acos();
            assert!(
                angle.to_degrees() < 6.0,
                "({x}, {y}) {}",
                angle.to_degrees()
            );
        }
    }
}
