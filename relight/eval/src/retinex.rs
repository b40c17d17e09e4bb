//! Colour Retinex: a decomposition that assumes that albedo changes in colour and shading does not.

use super::EvalError;
use super::run::{grey, of_grey};
use relight_core::image::{Extent, Linear, Planes, Rgb};

/// An image as albedo times shading.
#[derive(Debug, Clone, PartialEq)]
pub struct IntrinsicImages {
    /// The albedo.
    pub albedo: Rgb<Linear>,
    /// The shading, without colour.
    pub shading: Rgb<Linear>,
}

/// Colour Retinex after Grosse et al. (2009), on the chromaticity of linear images.
///
/// Of two neighbouring pixels the change in log brightness (the mean of the channels) is the
/// albedo's where their chromaticities, `rgb / (r + g + b)`, differ by more than `chromaticity` in
/// the sum of absolute differences or their log brightness by more than `brightness`, else the
/// shading's. The log albedo is the field whose differences fit these best, by least squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Retinex {
    /// Smallest change in chromaticity that is the albedo's.
    pub chromaticity: f32,
    /// Smallest change in log brightness that is; infinite where only colour decides.
    pub brightness: f32,
}

impl Default for Retinex {
    /// Colour alone decides, from 0.02 on: the best of 0.01, 0.02 and 0.04 on the ten objects of
    /// MIT Intrinsic Images that SIRFS trains on.
    fn default() -> Self {
        Self {
            chromaticity: 0.02,
            brightness: f32::INFINITY,
        }
    }
}

/// Values of less than this are taken as this before a logarithm.
const DARKEST: f32 = 1e-4;
/// Pulls the log albedo of parts without a known difference towards 0.
const DAMPING: f64 = 1e-5;
/// The solver stops at this residual, relative to the right side, ...
const RESIDUAL: f64 = 1e-6;
/// ... or after so many steps.
const MOST_STEPS: usize = 3000;

impl Retinex {
    /// Decomposes the pixels where `mask` is true; the others become 0.
    pub(super) fn decompose(
        self,
        image: &Rgb<Linear>,
        mask: &[bool],
    ) -> Result<IntrinsicImages, EvalError> {
        let extent = image.planes().extent();
        let brightness = grey(image);
        let log_albedo = self.edges(image, &brightness, mask).solve();
        let mut shading = vec![0.0; extent.pixels()];
        for ((at, log_albedo), brightness) in
            indices(mask).zip(log_albedo).zip(under(&brightness, mask))
        {
            shading[at] = brightness / (log_albedo.exp() as f32).max(f32::MIN_POSITIVE);
        }
        Ok(IntrinsicImages {
            albedo: divided(image, &shading),
            shading: of_grey(extent, shading)?,
        })
    }

    /// The differences of log albedo between neighbours under the mask.
    fn edges(self, image: &Rgb<Linear>, brightness: &[f32], mask: &[bool]) -> Field {
        let Extent { width, height } = image.planes().extent();
        let mut number = vec![None; mask.len()];
        for (count, at) in indices(mask).enumerate() {
            number[at] = Some(count);
        }
        let mut field = Field::new(indices(mask).count());
        for y in 0..height {
            for x in 0..width {
                let at = y * width + x;
                let right = (x + 1 < width).then_some(at + 1);
                let below = (y + 1 < height).then_some(at + width);
                for other in right.into_iter().chain(below) {
                    if let (Some(a), Some(b)) = (number[at], number[other]) {
                        let step = self.albedo_step(image, brightness, (at, other));
                        field.edges.push((a, b, step));
                    }
                }
            }
        }
        field
    }

    /// The change of log albedo from one pixel to its neighbour.
    fn albedo_step(self, image: &Rgb<Linear>, brightness: &[f32], (a, b): (usize, usize)) -> f64 {
        let log = |at: usize| brightness[at].max(DARKEST).ln();
        let change = log(b) - log(a);
        let planes = image.planes().planes();
        let chromaticity = |at: usize| {
            let sum = (3.0 * brightness[at]).max(DARKEST);
            planes.map(|plane| plane[at] / sum)
        };
        let colours = chromaticity(a).into_iter().zip(chromaticity(b));
        let turn: f32 = colours.map(|(a, b)| (a - b).abs()).sum();
        let is_albedo = turn > self.chromaticity || change.abs() > self.brightness;
        if is_albedo { f64::from(change) } else { 0.0 }
    }
}

/// A field of unknowns of which differences are known.
struct Field {
    unknowns: usize,
    /// `(a, b, d)`: the value at b less the value at a is d.
    edges: Vec<(usize, usize, f64)>,
}

impl Field {
    const fn new(unknowns: usize) -> Self {
        Self {
            unknowns,
            edges: Vec::new(),
        }
    }

    /// The values that fit best, by conjugate gradients on the normal equations with the diagonal as
    /// preconditioner.
    fn solve(&self) -> Vec<f64> {
        let mut diagonal = vec![DAMPING; self.unknowns];
        let mut residual = vec![0.0; self.unknowns];
        for &(a, b, step) in &self.edges {
            diagonal[a] += 1.0;
            diagonal[b] += 1.0;
            residual[a] -= step;
            residual[b] += step;
        }
        let mut values = vec![0.0; self.unknowns];
        let enough = RESIDUAL * RESIDUAL * dot(&residual, &residual);
        let mut direction = divided_by(&residual, &diagonal);
        let mut along = dot(&residual, &direction);
        for _ in 0..MOST_STEPS {
            if dot(&residual, &residual) <= enough {
                break;
            }
            let applied = self.apply(&direction);
            let length = along / dot(&direction, &applied);
            add(&mut values, length, &direction);
            add(&mut residual, -length, &applied);
            let scaled = divided_by(&residual, &diagonal);
            let next = dot(&residual, &scaled);
            let keep = next / along;
            for (value, new) in direction.iter_mut().zip(scaled) {
                *value = new + keep * *value;
            }
            along = next;
        }
        values
    }

    fn apply(&self, values: &[f64]) -> Vec<f64> {
        let mut result: Vec<f64> = values.iter().map(|value| DAMPING * value).collect();
        for &(a, b, _) in &self.edges {
            let step = values[b] - values[a];
            result[a] -= step;
            result[b] += step;
        }
        result
    }
}

/// The image divided by a shading; 0 where the shading is.
pub(super) fn divided(image: &Rgb<Linear>, shading: &[f32]) -> Rgb<Linear> {
    let mut planes: Planes<3> = image.planes().clone();
    for plane in planes.planes_mut() {
        for (value, &shading) in plane.iter_mut().zip(shading) {
            *value = if shading > 0.0 { *value / shading } else { 0.0 };
        }
    }
    Rgb::new(planes)
}

fn indices(mask: &[bool]) -> impl Iterator<Item = usize> {
    mask.iter()
        .enumerate()
        .filter_map(|(at, &inside)| inside.then_some(at))
}

fn under<'a>(plane: &'a [f32], mask: &'a [bool]) -> impl Iterator<Item = f32> {
    plane
        .iter()
        .zip(mask)
        .filter_map(|(&value, &inside)| inside.then_some(value))
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn add(to: &mut [f64], factor: f64, what: &[f64]) {
    for (to, what) in to.iter_mut().zip(what) {
        *to += factor * what;
    }
}

fn divided_by(values: &[f64], by: &[f64]) -> Vec<f64> {
    values
        .iter()
        .zip(by)
        .map(|(value, by)| value / by)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coloured_pattern_goes_to_the_albedo_and_a_smooth_change_to_the_shading() {
        let extent = Extent::new(24, 16);
        let shade = |x: usize| 0.2 + 0.03 * x as f32;
        let paint = |y: usize| {
            if y < 8 {
                [0.8, 0.2, 0.2]
            } else {
                [0.2, 0.5, 0.6]
            }
        };
        let image = Rgb::new(Planes::from_fn(extent, |x, y| {
            paint(y).map(|c| c * shade(x))
        }));
        let mask = vec![true; extent.pixels()];
        let found = Retinex::default().decompose(&image, &mask).unwrap();
        let shading = found.shading.planes();
        let albedo = found.albedo.planes();
        let gain = shading.pixel(0, 0)[0] / shade(0);
        for y in 0..16 {
            for x in 0..24 {
                let expected = gain * shade(x);
                let value = shading.pixel(x, y)[0];
                assert!((value / expected - 1.0).abs() < 0.01, "{x} {y}: {value}");
                let red = albedo.pixel(x, y)[0] * gain / paint(y)[0];
                assert!((red - 1.0).abs() < 0.01, "{x} {y}: {red}");
            }
        }
    }

    #[test]
    fn albedo_times_shading_is_the_image_and_nothing_is_found_outside_the_mask() {
        let extent = Extent::new(9, 9);
        let image = Rgb::new(Planes::from_fn(extent, |x, y| {
            [0.1 + 0.1 * x as f32, 0.5, 0.1 * y as f32]
        }));
        let mask: Vec<bool> = (0..81).map(|at| at % 9 != 4).collect();
        let found = Retinex::default().decompose(&image, &mask).unwrap();
        for (at, &inside) in mask.iter().enumerate() {
            let (x, y) = (at % 9, at / 9);
            let (a, s) = (found.albedo.planes(), found.shading.planes());
            let product = a.pixel(x, y)[0] * s.pixel(x, y)[0];
            let expected = if inside {
                image.planes().pixel(x, y)[0]
            } else {
                0.0
            };
            assert!((product - expected).abs() < 1e-5);
        }
    }

    #[test]
    fn a_black_image_stays_black() {
        let image = Rgb::new(Planes::zeros(Extent::new(5, 5)));
        let found = Retinex::default().decompose(&image, &[true; 25]).unwrap();
        let planes = [found.albedo.planes(), found.shading.planes()];
        assert!(planes.iter().all(|p| p.plane(0).iter().all(|&v| v == 0.0)));
    }
}
