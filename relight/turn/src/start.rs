//! Normals to begin with where nothing is known but the object's outline.

use relight_core::image::{Extent, Planes};

use super::TurnCurves;
use super::search::unit;

/// Steps of relaxation for each pixel of the longer side: over-relaxation needs so many in proportion to it.
const STEPS_A_PIXEL: usize = 4;

/// The normals of a round body in the outline of the mask, one a pixel: the height is the root of the solution
/// of Poisson's equation that is 0 at the outline, times `height`. At the outline the normals lie in the image
/// plane, as those of every smooth body do.
pub(super) fn inflated(curves: &TurnCurves, height: f64) -> Vec<[f64; 3]> {
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
        STEPS_A_PIXEL * extent.width.max(extent.height),
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

/// The image smoothed by a Gaussian of this deviation, pixels, over the pixels of the mask alone.
pub(super) fn blurred<const C: usize>(
    image: &Planes<C>,
    mask: &[bool],
    deviation: f64,
) -> Planes<C> {
    let reach = (3.0 * deviation).ceil() as isize;
    let taps: Vec<f32> = (-reach..=reach)
        .map(|at| (-0.5 * (at as f64 / deviation).powi(2)).exp() as f32)
        .collect();
    let extent = image.extent();
    let mut weights = Planes::<1>::zeros(extent);
    for (weight, &inside) in weights.planes_mut()[0].iter_mut().zip(mask) {
        *weight = f32::from(u8::from(inside));
    }
    let mut cut = image.clone();
    for plane in cut.planes_mut() {
        for (value, weight) in plane.iter_mut().zip(weights.plane(0)) {
            *value *= weight;
        }
    }
    let mut smooth = convolved(&cut, &taps);
    let weights = convolved(&weights, &taps);
    for plane in smooth.planes_mut() {
        for (value, weight) in plane.iter_mut().zip(weights.plane(0)) {
            *value /= weight.max(f32::MIN_POSITIVE);
        }
    }
    smooth
}

fn convolved<const C: usize>(image: &Planes<C>, taps: &[f32]) -> Planes<C> {
    let extent = image.extent();
    let reach = taps.len() / 2;
    let tap = |length: usize, at: usize, tap: usize| {
        (at + tap).checked_sub(reach).filter(|&to| to < length)
    };
    let mut across = Planes::<C>::zeros(extent);
    across.fill_rows(|y, row| {
        for (out, plane) in row.into_iter().zip(image.planes()) {
            let line = &plane[y * extent.width..][..extent.width];
            for (x, value) in out.iter_mut().enumerate() {
                let places = taps.iter().enumerate();
                let parts =
                    places.filter_map(|(k, t)| tap(extent.width, x, k).map(|at| t * line[at]));
                *value = parts.sum();
            }
        }
    });
    let mut down = Planes::<C>::zeros(extent);
    down.fill_rows(|y, row| {
        for (out, plane) in row.into_iter().zip(across.planes()) {
            for (k, t) in taps.iter().enumerate() {
                if let Some(at) = tap(extent.height, y, k) {
                    let line = &plane[at * extent.width..][..extent.width];
                    out.iter_mut().zip(line).for_each(|(sum, v)| *sum += t * v);
                }
            }
        }
    });
    down
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
            let angle = super::super::search::dot(*normal, ball).min(1.0).acos();
            assert!(
                angle.to_degrees() < 6.0,
                "({x}, {y}) {}",
                angle.to_degrees()
            );
        }
    }

    #[test]
    fn smoothing_keeps_an_even_image_even_up_to_the_edge_of_the_mask() {
        let image = Planes::filled(Extent::new(9, 7), [0.5]);
        let mask: Vec<bool> = (0..63).map(|at| at % 9 > 3).collect();
        let smooth = blurred(&image, &mask, 1.5);
        let inside = (0..63).filter(|&at| mask[at]);
        for at in inside {
            assert!((smooth.plane(0)[at] - 0.5).abs() < 1e-5);
        }
    }
}
