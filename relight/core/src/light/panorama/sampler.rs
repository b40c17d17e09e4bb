//! Random directions in proportion to a panorama's light.

use std::f64::consts::PI;

use super::Panorama;
use crate::light::Direction;

/// Draws directions from a panorama, each pixel in proportion to its mean radiance over the three
/// channels times its solid angle.
///
/// ```
/// use relight_core::image::{Extent, Planes, Rgb};
/// use relight_core::light::{Direction, LightSampler, Panorama};
///
/// // Light from the upper half only.
/// let sky = Planes::from_fn(Extent::new(4, 2), |_, y| [[2.0; 3], [0.0; 3]][y]);
/// let panorama = Panorama::new(Rgb::new(sky))?;
/// let sampler = LightSampler::new(&panorama);
/// let drawn = sampler.draw([0.9, 0.3]);
/// assert!(drawn.direction.dot(Direction::UP) > 0.0);
/// assert!((drawn.density * 2.0 * std::f64::consts::PI - 1.0).abs() < 1e-9);
/// # Ok::<(), relight_core::light::LightError>(())
/// ```
#[derive(Debug, Clone)]
pub struct LightSampler<'a> {
    panorama: &'a Panorama,
    /// The sums of all weights up to and with each row, and up to and with each pixel in its row.
    rows: Vec<f64>,
    columns: Vec<f64>,
}

/// A direction that was drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightSample {
    /// Where the light comes from.
    pub direction: Direction,
    /// Its radiance, linear RGB.
    pub radiance: [f64; 3],
    /// The probability density of the direction, per steradian.
    pub density: f64,
}

impl<'a> LightSampler<'a> {
    /// Prepares the sums. A black panorama is drawn from evenly.
    pub fn new(panorama: &'a Panorama) -> Self {
        let is_black = !sums(panorama, false).0.last().is_some_and(|&all| all > 0.0);
        let (rows, columns) = sums(panorama, is_black);
        Self {
            panorama,
            rows,
            columns,
        }
    }

    /// The direction that belongs to two numbers, each even in 0..1.
    pub fn draw(&self, [first, second]: [f64; 2]) -> LightSample {
        let (row, down) = find(&self.rows, first);
        let width = self.panorama.extent().width;
        let (column, across) = find(&self.columns[row * width..(row + 1) * width], second);
        // Even in the height over the horizon, which is even in solid angle.
        let height = self.panorama.extent().height as f64;
        let [top, bottom] = [row, row + 1].map(|edge| (PI * edge as f64 / height).cos());
        let polar = (top + (bottom - top) * down).clamp(-1.0, 1.0).acos();
        let direction = self
            .panorama
            .direction(column as f64 + across, polar * height / PI);
        LightSample {
            direction,
            radiance: self
                .panorama
                .image
                .planes()
                .pixel(column, row)
                .map(f64::from),
            density: self.density_of_pixel(column, row),
        }
    }

    /// The density with which a direction is drawn, per steradian.
    pub fn density(&self, direction: Direction) -> f64 {
        let (x, y) = self.panorama.pixel_towards(direction);
        self.density_of_pixel(x, y)
    }

    /// The panorama that is drawn from.
    pub const fn panorama(&self) -> &'a Panorama {
        self.panorama
    }

    fn density_of_pixel(&self, x: usize, y: usize) -> f64 {
        let width = self.panorama.extent().width;
        let row = &self.columns[y * width..(y + 1) * width];
        let before = if x == 0 { 0.0 } else { row[x - 1] };
        let all = self.rows[self.rows.len() - 1];
        (row[x] - before) / all / self.panorama.solid_angle(y)
    }
}

/// The running sums of the weights of the rows, and of the pixels in each row.
fn sums(panorama: &Panorama, is_even: bool) -> (Vec<f64>, Vec<f64>) {
    let planes = panorama.image.planes().planes();
    let width = panorama.extent().width;
    let mut all = 0.0;
    let (mut rows, mut columns) = (Vec::new(), Vec::new());
    for row in 0..panorama.extent().height {
        let area = panorama.solid_angle(row);
        let mut sum = 0.0;
        for at in row * width..(row + 1) * width {
            let radiance: f64 = planes.iter().map(|plane| f64::from(plane[at].abs())).sum();
            sum += area * if is_even { 1.0 } else { radiance };
            columns.push(sum);
        }
        all += sum;
        rows.push(all);
    }
    (rows, columns)
}

/// The first entry above that part of the last, and how far it is through the entry, 0..1.
fn find(sums: &[f64], part: f64) -> (usize, f64) {
    let last = sums.len() - 1;
    let wanted = part.clamp(0.0, 1.0) * sums[last];
    let at = sums.partition_point(|&sum| sum <= wanted).min(last);
    let before = if at == 0 { 0.0 } else { sums[at - 1] };
    let through = (wanted - before) / (sums[at] - before);
    (
        at,
        if through.is_finite() {
            through.clamp(0.0, 1.0)
        } else {
            0.5
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Extent, Planes, Rgb};

    fn panorama(pixel: impl FnMut(usize, usize) -> [f32; 3]) -> Panorama {
        Panorama::new(Rgb::new(Planes::from_fn(Extent::new(8, 4), pixel))).unwrap()
    }

    #[test]
    fn the_density_of_what_is_drawn_is_the_one_that_is_told_and_fits_its_radiance() {
        let light = panorama(|x, y| [(x * y) as f32, 0.5, x as f32]);
        let sampler = LightSampler::new(&light);
        let first = sampler.draw([0.1, 0.1]);
        for step in 0..100 {
            let part = f64::from(step) / 100.0;
            let drawn = sampler.draw([part, (part * 7.0).fract()]);
            assert!((sampler.density(drawn.direction) / drawn.density - 1.0).abs() < 1e-9);
            let ratio = |d: LightSample| d.radiance.iter().sum::<f64>() / d.density;
            assert!((ratio(drawn) / ratio(first) - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn densities_sum_up_to_one() {
        for light in [
            panorama(|x, y| [(x + y) as f32; 3]),
            panorama(|_, _| [0.0; 3]),
        ] {
            let sampler = LightSampler::new(&light);
            let pixels = (0..4).flat_map(|y| (0..8).map(move |x| (x, y)));
            let all: f64 = pixels
                .map(|(x, y)| sampler.density_of_pixel(x, y) * light.solid_angle(y))
                .sum();
            assert!((all - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_dark_pixel_is_never_drawn() {
        let light = panorama(|x, _| [[0.0; 3], [1.0; 3]][x % 2]);
        let sampler = LightSampler::new(&light);
        for part in [0.0, 0.25, 0.5, 0.999_999, 1.0] {
            assert!(sampler.draw([part, part]).radiance[0] > 0.0, "{part}");
        }
    }
}
