//! Maps smoothed under a mask.

use relight_core::image::Planes;

use crate::model::directions::unit;
use crate::observe::curves::TurnCurves;

/// The image smoothed by a Gaussian of this deviation, pixels, over the pixels of the mask alone.
pub(crate) fn blurred<const C: usize>(
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

/// The normals of a turn's pixels, smoothed under its mask.
pub(crate) fn smoothed_normals(
    curves: &TurnCurves,
    deviation: f64,
    normal: impl Fn(usize) -> [f64; 3],
) -> Vec<[f64; 3]> {
    let map = curves.map(|pixel| normal(pixel).map(|v| v as f32));
    let smooth = blurred(&map, &curves.mask(), deviation);
    let [x, y, z] = smooth.planes();
    let at = |&place: &usize| unit([x, y, z].map(|plane| f64::from(plane[place])));
    curves.places().iter().map(at).collect()
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
    use relight_core::image::Extent;

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
