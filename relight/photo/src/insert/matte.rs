//! How much of each pixel the object covers, and its colours freed of what lay behind it. Knows nothing of light.

use super::smooth::{blurred, weighted_mean};
use relight_core::image::{Extent, Planes};

/// How far a matte may lie from the mask where colours say otherwise.
const GEOMETRY_DEVIATION: f32 = 0.25;
/// The deviation of colours that counts where they do not vary at all, as a part of them.
const LEAST_DEVIATION: f32 = 0.08;
/// The weight of the object's edge where nothing of its inside is near.
const EDGE_WEIGHT: f32 = 1e-3;
/// The part of an object's side that its soft edge is wide.
const EDGE_PART: f64 = 1.0 / 160.0;

/// What an object covers, and its own colours.
///
/// The picture is `alpha x foreground + (1 - alpha) x background`. Pixels at the edge show both; pasted as they are, they
/// bring a rim of the old background along.
#[derive(Debug, Clone, PartialEq)]
pub struct Matte {
    /// The part of each pixel that the object covers, 0 to 1.
    pub alpha: Planes<1>,
    /// The object's colours, linear, also where it covers little or nothing of a pixel: those of its edge go on there.
    pub foreground: Planes<3>,
}

impl Matte {
    /// The matte of an object in a picture of linear light, near whose mask (0 or 1) it is to be looked for: `edge` pixels to
    /// both sides of the mask's edge.
    ///
    /// In that band, F and B are the mean colours of the object and of the background nearby. Alpha is the value for which
    /// `alpha F + (1 - alpha) B` is nearest to the pixel, measured by how much the colours vary there, drawn towards the smoothed mask. The
    /// colours are F and the part alpha of what is left, as in Forte, "Approximate Fast Foreground Colour Estimation" (2021).
    ///
    /// # Panics
    /// Where the mask has another size.
    #[must_use]
    pub fn estimate(picture: &Planes<3>, mask: &Planes<1>, edge: usize) -> Self {
        assert_eq!(picture.extent(), mask.extent(), "size of the mask");
        let edge = edge.max(1);
        let share = blurred(mask, edge);
        let smooth = blurred(&blurred(mask, edge.div_ceil(2)), edge.div_ceil(2));
        let inside = share.clone().map(|s| f32::from(u8::from(s > 1.0 - 1e-4)));
        let outside = share.map(|s| f32::from(u8::from(s < 1e-4)));
        let mut object_weights = inside.clone();
        let pairs = object_weights.planes_mut()[0].iter_mut().zip(mask.plane(0));
        pairs.for_each(|(weight, m)| *weight = weight.max(EDGE_WEIGHT * m));
        let reach = 2 * edge + 1;
        let object = Neighbours::of(picture, &object_weights, reach);
        let around = Neighbours::of(picture, &outside, reach);
        let mut matte = Self {
            alpha: inside,
            foreground: picture.clone(),
        };
        let Extent { width, height } = picture.extent();
        for y in 0..height {
            for x in 0..width {
                if matte.alpha.pixel(x, y) == [1.0] {
                    continue;
                }
                let is_outside = outside.pixel(x, y) == [1.0];
                let (alpha, colour) = if is_outside {
                    (0.0, object.mean.pixel(x, y))
                } else {
                    mixed(picture.pixel(x, y), smooth.pixel(x, y)[0], |of| match of {
                        Side::Object => object.at(x, y),
                        Side::Around => around.at(x, y),
                    })
                };
                matte.alpha.set_pixel(x, y, [alpha]);
                matte.foreground.set_pixel(x, y, colour);
            }
        }
        matte.continued(reach)
    }

    /// The matte of a cut-out picture, whose colours are the object's own wherever it covers something.
    ///
    /// # Panics
    /// Where alpha has another size.
    #[must_use]
    pub fn of_cut_out(picture: &Planes<3>, alpha: &Planes<1>) -> Self {
        assert_eq!(picture.extent(), alpha.extent(), "size of alpha");
        let matte = Self {
            alpha: alpha.clone().map(|a| a.clamp(0.0, 1.0)),
            foreground: picture.clone(),
        };
        matte.continued(1)
    }

    /// How many pixels wide the soft edge of an object of this size is taken to be, where nothing is known of the lens.
    #[must_use]
    pub fn edge_for(extent: Extent) -> usize {
        let side = extent.width.max(extent.height) as f64;
        ((side * EDGE_PART).round() as usize).clamp(2, 12)
    }

    /// Colours where the object covers nothing: the nearest that it has.
    fn continued(mut self, reach: usize) -> Self {
        let covered: Vec<bool> = self.alpha.plane(0).iter().map(|&a| a > 0.0).collect();
        let near = blurred(&self.alpha, reach);
        let wanted: Vec<bool> = near.plane(0).iter().map(|&a| a > 0.0).collect();
        for plane in self.foreground.planes_mut() {
            for (value, covered) in plane.iter_mut().zip(&covered) {
                *value = if *covered { *value } else { 0.0 };
            }
        }
        self.foreground = self.foreground.extended(&covered, &wanted);
        self
    }
}

#[derive(Clone, Copy)]
enum Side {
    Object,
    Around,
}

/// Mean and variance of the colours nearby.
struct Neighbours {
    mean: Planes<3>,
    square: Planes<3>,
    weight: Planes<1>,
}

impl Neighbours {
    fn of(picture: &Planes<3>, weights: &Planes<1>, reach: usize) -> Self {
        let (mean, weight) = weighted_mean(picture, weights, reach);
        let squares = picture.clone().map(|v| v * v);
        let (square, _) = weighted_mean(&squares, weights, reach);
        Self {
            mean,
            square,
            weight,
        }
    }

    /// The mean colour, and the mean variance of a channel; none where nothing is near.
    fn at(&self, x: usize, y: usize) -> Option<([f32; 3], f32)> {
        if self.weight.pixel(x, y)[0] <= 0.0 {
            return None;
        }
        let (mean, square) = (self.mean.pixel(x, y), self.square.pixel(x, y));
        let variance: f32 = (0..3)
            .map(|c| (square[c] - mean[c] * mean[c]).max(0.0))
            .sum();
        Some((mean, variance / 3.0))
    }
}

/// Alpha and the object's colour of a pixel that may show both.
fn mixed(
    pixel: [f32; 3],
    geometry: f32,
    neighbours: impl Fn(Side) -> Option<([f32; 3], f32)>,
) -> (f32, [f32; 3]) {
    let Some((object, object_variance)) = neighbours(Side::Object) else {
        return (geometry, pixel);
    };
    let Some((around, around_variance)) = neighbours(Side::Around) else {
        return (geometry, pixel);
    };
    let difference: [f32; 3] = [0, 1, 2].map(|c| object[c] - around[c]);
    let level: f32 = (0..3)
        .map(|c| object[c].abs() + around[c].abs())
        .sum::<f32>()
        / 6.0;
    let least = LEAST_DEVIATION * (level + LEAST_DEVIATION);
    let variance = object_variance + around_variance + least * least;
    let prior = GEOMETRY_DEVIATION * GEOMETRY_DEVIATION;
    let along: f32 = (0..3).map(|c| (pixel[c] - around[c]) * difference[c]).sum();
    let length: f32 = difference.iter().map(|d| d * d).sum();
    let alpha = (along / variance + geometry / prior) / (length / variance + 1.0 / prior);
    let alpha = alpha.clamp(0.0, 1.0);
    let colour = [0, 1, 2].map(|c| {
        let rest = pixel[c] - alpha * object[c] - (1.0 - alpha) * around[c];
        (object[c] + alpha * rest).max(0.0)
    });
    (alpha, colour)
}

#[cfg(test)]
mod tests {
    use super::*;

    const OBJECT: [f32; 3] = [0.6, 0.3, 0.1];
    const AROUND: [f32; 3] = [0.05, 0.2, 0.7];

    /// The part of a pixel that lies in a disc, by 8 x 8 samples.
    fn coverage(x: usize, y: usize) -> f32 {
        let inside = (0..64).filter(|k| {
            let place = |at: usize, k: usize| at as f64 + (k as f64 + 0.5) / 8.0 - 32.0;
            place(x, k % 8).hypot(place(y, k / 8)) < 20.3
        });
        inside.count() as f32 / 64.0
    }

    fn picture() -> (Planes<3>, Planes<1>) {
        let extent = Extent::new(64, 64);
        let mix = |x, y| {
            let alpha = coverage(x, y);
            [0, 1, 2].map(|c| alpha * OBJECT[c] + (1.0 - alpha) * AROUND[c])
        };
        let mask = Planes::from_fn(extent, |x, y| [f32::from(u8::from(coverage(x, y) >= 0.5))]);
        (Planes::from_fn(extent, mix), mask)
    }

    #[test]
    fn alpha_is_the_coverage_and_colours_are_free_of_the_background() {
        let (picture, mask) = picture();
        let matte = Matte::estimate(&picture, &mask, 2);
        for y in 0..64 {
            for x in 0..64 {
                let alpha = matte.alpha.pixel(x, y)[0];
                assert!((alpha - coverage(x, y)).abs() < 0.02, "{x} {y} {alpha}");
                if alpha > 0.0 {
                    let colour = matte.foreground.pixel(x, y);
                    let apart = (0..3)
                        .map(|c| (colour[c] - OBJECT[c]).abs())
                        .fold(0.0, f32::max);
                    assert!(apart < 0.02, "{x} {y} {colour:?}");
                }
            }
        }
    }

    #[test]
    fn where_colours_are_alike_the_mask_decides() {
        let (_, mask) = picture();
        let grey = Planes::filled(mask.extent(), [0.4; 3]);
        let matte = Matte::estimate(&grey, &mask, 2);
        for y in 0..64 {
            for x in 0..64 {
                let apart = matte.alpha.pixel(x, y)[0] - coverage(x, y);
                assert!(apart.abs() < 0.75, "{x} {y} {apart}");
            }
        }
        assert_eq!(matte.alpha.pixel(32, 32), [1.0]);
        assert_eq!(matte.alpha.pixel(1, 1), [0.0]);
    }

    #[test]
    fn a_cut_out_keeps_its_alpha_and_what_lies_under_nothing_is_forgotten() {
        let extent = Extent::new(8, 1);
        let picture = Planes::from_fn(extent, |x, _| [if x < 4 { 0.5 } else { 9.0 }; 3]);
        let alpha = Planes::from_fn(extent, |x, _| [[1.0, 1.0, 0.7, 0.2, 0.0, 0.0, 0.0, 0.0][x]]);
        let matte = Matte::of_cut_out(&picture, &alpha);
        assert_eq!(matte.alpha, alpha);
        assert_eq!(matte.foreground.pixel(4, 0), [0.5; 3]);
    }
}
