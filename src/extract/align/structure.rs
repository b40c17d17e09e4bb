//! What is compared of two pictures: the gradients of their brightness's logarithm, at a fine scale.
//!
//! The logarithm makes paint and light a sum, so that a change of the light's strength disappears in the
//! gradient. What is left of the light is smooth, and the band-pass removes most of it; paint, creases
//! and edges of the surface remain.

use image::GrayImage;

use crate::extract::View;

/// Added to the brightness before the logarithm, 8-bit levels: dark pixels are mostly noise.
const DARK: f32 = 8.0;
/// Standard deviations of the two Gaussians of the band-pass, pixels.
const FINE: f32 = 0.5;
const COARSE: f32 = 1.2;

/// Values of a picture's pixels, row by row.
#[derive(Debug, Clone, Default)]
pub(super) struct Plane {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<f32>,
}

impl Plane {
    fn resize(&mut self, width: usize, height: usize) {
        (self.width, self.height) = (width, height);
        self.values.resize(width * height, 0.0);
    }

    /// Row `y`; the nearest one where there is none.
    pub(super) fn row(&self, y: isize) -> &[f32] {
        let last = self.height.saturating_sub(1);
        let y = usize::try_from(y).unwrap_or(0).min(last);
        self.values
            .get(y * self.width..(y + 1) * self.width)
            .unwrap_or_default()
    }
}

/// Horizontal and vertical gradients of a [`Plane`], side by side.
#[derive(Debug, Default)]
pub(super) struct Gradients {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<[f32; 2]>,
}

/// Turns pictures into planes and gradients; keeps its buffers.
#[derive(Debug)]
pub(super) struct Extractor {
    logarithms: Vec<f32>,
    fine: Vec<f32>,
    rest: Vec<f32>,
    rows: Plane,
    blurred: Plane,
    light: Plane,
    line: Vec<f32>,
}

impl Default for Extractor {
    fn default() -> Self {
        Self {
            logarithms: (0..=u8::MAX).map(|v| (f32::from(v) + DARK).ln()).collect(),
            fine: gaussian(FINE),
            // Blurring twice adds the variances.
            rest: gaussian((COARSE * COARSE - FINE * FINE).sqrt()),
            rows: Plane::default(),
            blurred: Plane::default(),
            light: Plane::default(),
            line: Vec::new(),
        }
    }
}

impl Extractor {
    /// The fine structure of a picture's brightness.
    pub(super) fn structure(&mut self, luma: &GrayImage, out: &mut Plane) {
        let (width, height) = (luma.width() as usize, luma.height() as usize);
        self.light.resize(width, height);
        for (light, &level) in self.light.values.iter_mut().zip(luma.as_raw()) {
            *light = self
                .logarithms
                .get(usize::from(level))
                .copied()
                .unwrap_or_default();
        }
        let Self { rows, line, .. } = self;
        blur(&self.light, &self.fine, rows, line, &mut self.blurred);
        blur(&self.blurred, &self.rest, rows, line, out);
        for (coarse, fine) in out.values.iter_mut().zip(&self.blurred.values) {
            *coarse = fine - *coarse;
        }
    }
}

impl Gradients {
    /// Replaces these by the gradients of `plane`; 0 at its border.
    pub(super) fn take(&mut self, plane: &Plane) {
        (self.width, self.height) = (plane.width, plane.height);
        self.values.clear();
        self.values.resize(plane.values.len(), [0.0; 2]);
        if plane.width < 3 || plane.height < 3 {
            return;
        }
        let rows = self.values.chunks_exact_mut(plane.width).enumerate();
        for (y, row) in rows.skip(1).take(plane.height - 2) {
            let y = y as isize;
            let sides = plane.row(y).windows(3);
            let above = plane.row(y - 1).iter().skip(1);
            let below = plane.row(y + 1).iter().skip(1);
            let sides = sides.zip(above.zip(below));
            for (gradient, (side, (above, below))) in row.iter_mut().skip(1).zip(sides) {
                *gradient = [0.5 * (side[2] - side[0]), 0.5 * (below - above)];
            }
        }
    }
}

/// The weights of four neighbouring values for a place that lies by `part` (0..1) behind the second of
/// them: Keys' cubic convolution (1981), a = -1/2.
pub(super) fn cubic(part: f32) -> [f32; 4] {
    let (t, t2, t3) = (part, part * part, part * part * part);
    [
        0.5 * (-t3 + 2.0 * t2 - t),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (-3.0 * t3 + 4.0 * t2 + t),
        0.5 * (t3 - t2),
    ]
}

/// Brightness of a picture, 0..=255.
pub(super) fn luma(picture: View<'_>) -> GrayImage {
    let pixels = picture.rows().flat_map(|row| row.chunks_exact(4));
    let levels = pixels.map(|p| {
        let sum = 77 * u32::from(p[0]) + 150 * u32::from(p[1]) + 29 * u32::from(p[2]);
        (sum >> 8) as u8
    });
    let (width, height) = picture.dimensions();
    let mut grey = GrayImage::new(width, height);
    grey.iter_mut()
        .zip(levels)
        .for_each(|(to, level)| *to = level);
    grey
}

/// Half the picture: means of two by two pixels.
pub(super) fn half(image: &GrayImage) -> GrayImage {
    let (width, height) = (image.width() / 2, image.height() / 2);
    let source = image.width() as usize;
    let mut small = GrayImage::new(width, height);
    let pairs = image.as_raw().chunks_exact((2 * source).max(1));
    let rows = small
        .as_flat_samples_mut()
        .samples
        .chunks_exact_mut((width as usize).max(1));
    for (row, pair) in rows.zip(pairs) {
        let (above, below) = pair.split_at(source);
        let columns = above.chunks_exact(2).zip(below.chunks_exact(2));
        for (to, (a, b)) in row.iter_mut().zip(columns) {
            let sum: u16 = [a[0], a[1], b[0], b[1]].into_iter().map(u16::from).sum();
            *to = ((sum + 2) / 4) as u8;
        }
    }
    small
}

/// A Gaussian of this standard deviation, cut off at three of them; its sum is 1.
fn gaussian(deviation: f32) -> Vec<f32> {
    let radius = (3.0 * deviation).ceil();
    let places = (0..=2 * radius as usize).map(|at| at as f32 - radius);
    let values: Vec<f32> = places
        .map(|x| (-0.5 * (x / deviation).powi(2)).exp())
        .collect();
    let sum: f32 = values.iter().sum();
    values.iter().map(|value| value / sum).collect()
}

/// Both passes of a separable filter; the border is continued.
fn blur(from: &Plane, kernel: &[f32], rows: &mut Plane, line: &mut Vec<f32>, to: &mut Plane) {
    let width = from.width;
    rows.resize(width, from.height);
    to.resize(width, from.height);
    if width == 0 {
        return;
    }
    let radius = kernel.len() / 2;
    for (source, target) in from
        .values
        .chunks_exact(width)
        .zip(rows.values.chunks_exact_mut(width))
    {
        line.clear();
        line.extend(std::iter::repeat_n(source[0], radius));
        line.extend_from_slice(source);
        line.extend(std::iter::repeat_n(source[width - 1], radius));
        target.fill(0.0);
        for (at, weight) in kernel.iter().enumerate() {
            add_scaled(target, &line[at..], *weight);
        }
    }
    for (y, target) in to.values.chunks_exact_mut(width).enumerate() {
        target.fill(0.0);
        for (at, weight) in kernel.iter().enumerate() {
            add_scaled(
                target,
                rows.row(y as isize + at as isize - radius as isize),
                *weight,
            );
        }
    }
}

/// `to += weight * from`.
pub(super) fn add_scaled(to: &mut [f32], from: &[f32], weight: f32) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += weight * from;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    #[test]
    fn a_brighter_light_leaves_the_structure_of_bright_pixels_as_it_is() {
        let picture = |strength: f32| {
            GrayImage::from_fn(40, 30, |x, y| {
                let paint = if (x / 5 + y / 5) % 2 == 0 {
                    60.0
                } else {
                    100.0
                };
                Luma([(paint * strength) as u8])
            })
        };
        let mut extractor = Extractor::default();
        let [mut dim, mut bright] = [Plane::default(), Plane::default()];
        extractor.structure(&picture(1.0), &mut dim);
        extractor.structure(&picture(2.0), &mut bright);
        let largest = dim.values.iter().fold(0.0_f32, |most, v| most.max(v.abs()));
        for (a, b) in dim.values.iter().zip(&bright.values) {
            assert!((a - b).abs() < 0.1 * largest, "{a} {b} {largest}");
        }
    }

    #[test]
    fn an_even_picture_has_no_structure() {
        let mut plane = Plane::default();
        let grey = GrayImage::from_pixel(20, 10, Luma([77]));
        Extractor::default().structure(&grey, &mut plane);
        assert!(plane.values.iter().all(|value| value.abs() < 1e-5));
    }

    #[test]
    fn the_cubic_weights_sum_to_one_and_reproduce_a_line() {
        for part in [0.0, 0.25, 0.5, 0.9] {
            let weights = cubic(part);
            let sum: f32 = weights.iter().sum();
            let line: f32 = weights
                .iter()
                .zip([-1.0, 0.0, 1.0, 2.0])
                .map(|(w, v)| w * v)
                .sum();
            assert!((sum - 1.0).abs() < 1e-6 && (line - part).abs() < 1e-6);
        }
    }

    #[test]
    fn half_a_picture_has_the_means_and_an_odd_edge_is_left_out() {
        let image = GrayImage::from_raw(3, 2, vec![0, 4, 9, 8, 12, 9]).unwrap();
        assert_eq!(half(&image).as_raw(), &[6]);
    }
}
