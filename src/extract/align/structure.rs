//! What is compared of two pictures: the gradients of their brightness's logarithm, at a fine scale.
//!
//! The logarithm makes paint and light a sum, so that a change of the light's strength disappears in the
//! gradient. What is left of the light is smooth, and the band-pass removes most of it; paint, creases
//! and edges of the surface remain.

use image::GrayImage;
use pulp::{Arch, Simd, WithSimd};

use crate::CropView;

/// Added to the brightness before the logarithm, 8-bit levels: dark pixels are mostly noise.
const DARK: f32 = 8.0;
/// Standard deviations of the two Gaussians of the band-pass, pixels.
const FINE: f32 = 0.5;
const COARSE: f32 = 1.2;
/// Values of the finer one, and of the one that makes the coarser of it: up to three deviations.
const FINE_TAPS: usize = 5;
const REST_TAPS: usize = 9;

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
    fine: [f32; FINE_TAPS],
    rest: [f32; REST_TAPS],
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
        Arch::new().dispatch(Structure {
            extractor: self,
            luma,
            out,
        });
    }
}

/// The making of one plane, compiled for the kind of processor.
struct Structure<'a> {
    extractor: &'a mut Extractor,
    luma: &'a GrayImage,
    out: &'a mut Plane,
}

impl WithSimd for Structure<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self {
            extractor,
            luma,
            out,
        } = self;
        let Extractor {
            logarithms,
            fine,
            rest,
            rows,
            blurred,
            light,
            line,
        } = extractor;
        light.resize(luma.width() as usize, luma.height() as usize);
        for (light, &level) in light.values.iter_mut().zip(luma.as_raw()) {
            *light = logarithms
                .get(usize::from(level))
                .copied()
                .unwrap_or_default();
        }
        blur(light, fine, rows, line, blurred);
        blur(blurred, rest, rows, line, out);
        for (coarse, fine) in out.values.iter_mut().zip(&blurred.values) {
            *coarse = fine - *coarse;
        }
    }
}

impl Gradients {
    /// The gradient of a pixel; `None` beyond the picture.
    pub(super) fn at(&self, x: u32, y: u32) -> Option<[f32; 2]> {
        let (x, y) = (x as usize, y as usize);
        let inside = x < self.width && y < self.height;
        let found = inside.then(|| self.values.get(y * self.width + x))?;
        found.copied()
    }

    /// Replaces these by the gradients of `plane`; 0 at its border.
    pub(super) fn take(&mut self, plane: &Plane) {
        (self.width, self.height) = (plane.width, plane.height);
        self.values.resize(plane.values.len(), [0.0; 2]);
        Arch::new().dispatch(Taking(self, plane));
    }
}

/// The making of gradients, compiled for the kind of processor.
struct Taking<'a>(&'a mut Gradients, &'a Plane);

impl WithSimd for Taking<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self(gradients, plane) = self;
        let (width, height) = (plane.width, plane.height);
        for (y, row) in (0..).zip(gradients.values.chunks_exact_mut(width.max(1))) {
            if width < 3 || y == 0 || y + 1 == height as isize {
                row.fill([0.0; 2]);
                continue;
            }
            let (above, here, below) = (plane.row(y - 1), plane.row(y), plane.row(y + 1));
            (row[0], row[width - 1]) = ([0.0; 2], [0.0; 2]);
            let inner = row[1..width - 1].iter_mut();
            let across = here[2..].iter().zip(here);
            let down = below[1..].iter().zip(&above[1..]);
            for ((gradient, (right, left)), (below, above)) in inner.zip(across).zip(down) {
                *gradient = [0.5 * (right - left), 0.5 * (below - above)];
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
pub(super) fn luma(picture: CropView<'_>) -> GrayImage {
    Arch::new().dispatch(Luma {
        picture,
        half: false,
    })
}

/// The brightness of half the picture, each pixel the mean of two by two.
pub(super) fn half_luma(picture: CropView<'_>) -> GrayImage {
    Arch::new().dispatch(Luma {
        picture,
        half: true,
    })
}

/// The making of a picture's brightness, compiled for the kind of processor.
struct Luma<'a> {
    picture: CropView<'a>,
    half: bool,
}

impl WithSimd for Luma<'_> {
    type Output = GrayImage;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> GrayImage {
        let by = if self.half { 2 } else { 1 };
        let (width, height) = self.picture.dimensions();
        let mut grey = GrayImage::new(width / by, height / by);
        let rows = grey.as_flat_samples_mut().samples;
        let rows = rows.chunks_exact_mut(((width / by) as usize).max(1));
        let mut line = vec![0_u32; width as usize];
        for (to, y) in rows.zip((0_i64..).step_by(by as usize)) {
            let above = self.picture.row(y, 0);
            if self.half {
                let below = self.picture.row(y + 1, 0).chunks_exact(4);
                let columns = line.iter_mut().zip(above.chunks_exact(4)).zip(below);
                for ((sum, above), below) in columns {
                    *sum = sum_of(above) + sum_of(below);
                }
                for (to, pair) in to.iter_mut().zip(line.chunks_exact(2)) {
                    *to = ((pair[0] + pair[1]) >> 10) as u8;
                }
            } else {
                for (to, pixel) in to.iter_mut().zip(above.chunks_exact(4)) {
                    *to = (sum_of(pixel) >> 8) as u8;
                }
            }
        }
        grey
    }
}

/// 256 times a pixel's brightness.
#[inline(always)]
fn sum_of(pixel: &[u8]) -> u32 {
    let all = u32::from_le_bytes([pixel[0], pixel[1], pixel[2], pixel[3]]);
    77 * (all & 255) + 150 * ((all >> 8) & 255) + 29 * ((all >> 16) & 255)
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

/// A Gaussian of this standard deviation, cut off at both ends; its sum is 1.
fn gaussian<const TAPS: usize>(deviation: f32) -> [f32; TAPS] {
    let radius = (TAPS / 2) as f32;
    let values: [f32; TAPS] =
        std::array::from_fn(|at| (-0.5 * ((at as f32 - radius) / deviation).powi(2)).exp());
    let sum: f32 = values.iter().sum();
    values.map(|value| value / sum)
}

/// Both passes of a separable filter; the border is continued.
#[inline(always)]
fn blur<const TAPS: usize>(
    from: &Plane,
    kernel: &[f32; TAPS],
    rows: &mut Plane,
    line: &mut Vec<f32>,
    to: &mut Plane,
) {
    let width = from.width;
    rows.resize(width, from.height);
    to.resize(width, from.height);
    if width == 0 {
        return;
    }
    let radius = TAPS / 2;
    for (source, target) in from
        .values
        .chunks_exact(width)
        .zip(rows.values.chunks_exact_mut(width))
    {
        line.clear();
        line.extend(std::iter::repeat_n(source[0], radius));
        line.extend_from_slice(source);
        line.extend(std::iter::repeat_n(source[width - 1], radius));
        weigh(
            std::array::from_fn(|at| &line[at..at + width]),
            kernel,
            target,
        );
    }
    for (y, target) in (0..).zip(to.values.chunks_exact_mut(width)) {
        let row = |at: usize| rows.row(y + at as isize - radius as isize);
        weigh(std::array::from_fn(row), kernel, target);
    }
}

/// The sum of lines times their weights.
#[inline(always)]
fn weigh<const TAPS: usize>(lines: [&[f32]; TAPS], kernel: &[f32; TAPS], to: &mut [f32]) {
    let length = to.len();
    let lines = lines.map(|line| &line[..length]);
    for (x, to) in to.iter_mut().enumerate() {
        let mut sum = 0.0;
        for (line, weight) in lines.iter().zip(kernel) {
            sum += weight * line[x];
        }
        *to = sum;
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
