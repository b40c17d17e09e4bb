//! What is compared of two pictures: the gradients of their brightness's logarithm, at a fine scale.
//!
//! The logarithm makes paint and light a sum, so that a change of the light's strength disappears in the
//! gradient. What is left of the light is smooth, and the band-pass removes most of it; paint, creases
//! and edges of the surface remain.

use std::ops::Range;

use image::GrayImage;
use pulp::{Arch, Simd, WithSimd};

use super::region::Region;

/// Added to the brightness before the logarithm, 8-bit levels: dark pixels are mostly noise.
const DARK: f32 = 8.0;
/// Standard deviations of the two Gaussians of the band-pass, pixels.
const FINE: f32 = 0.5;
const COARSE: f32 = 1.2;
/// Values of the finer one, and of the one that makes the coarser of it: up to two deviations or more.
const FINE_TAPS: usize = 3;
const REST_TAPS: usize = 7;
const FINE_RADIUS: usize = FINE_TAPS / 2;
const REST_RADIUS: usize = REST_TAPS / 2;
/// Pixels around a place that are looked at to know its gradient.
pub(super) const AROUND: usize = 1 + REST_RADIUS + FINE_RADIUS;
/// Columns that a row has on both sides of the picture's, to be filtered.
const MARGIN: usize = REST_RADIUS;

/// Values of a picture's pixels, row by row.
#[derive(Debug, Clone, Default)]
pub(super) struct Plane {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<f32>,
}

impl Plane {
    /// Row `y`; beyond the picture its nearest row.
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

/// What is needed of a picture, and of what is made of it on the way, for gradients at some places.
#[derive(Debug, Clone)]
pub(super) struct Needs {
    gradients: Region,
    plane: Region,
    /// The coarser light before and after it is filtered down: rows that are filtered across.
    coarse_rows: Region,
    fine: Region,
    fine_rows: Region,
    /// Of the picture.
    pub(super) luma: Region,
}

impl Needs {
    /// For these gradients.
    pub(super) fn from_gradients(gradients: Region) -> Self {
        let plane = gradients.grown(1, 1);
        let coarse_rows = plane.grown(REST_RADIUS, 0);
        let fine = coarse_rows.grown(0, REST_RADIUS);
        let fine_rows = fine.grown(FINE_RADIUS, 0);
        Self {
            luma: fine_rows.grown(0, FINE_RADIUS),
            gradients,
            plane,
            coarse_rows,
            fine,
            fine_rows,
        }
    }
}

/// Rows of a picture; each replaces an earlier one that is no longer needed.
#[derive(Debug, Default)]
struct Rows(Vec<Vec<f32>>);

impl Rows {
    /// Room for `count` rows; what they held does not count.
    fn resize(&mut self, count: usize, width: usize) {
        self.0.resize_with(count, Vec::new);
        for row in &mut self.0 {
            row.resize(width + 2 * MARGIN, 0.0);
        }
    }

    #[inline(always)]
    fn row(&self, y: usize) -> &[f32] {
        &self.0[y % self.0.len()]
    }

    #[inline(always)]
    fn row_mut(&mut self, y: usize) -> &mut Vec<f32> {
        let count = self.0.len();
        &mut self.0[y % count]
    }

    /// The rows around `y`; beyond the picture its first or last row.
    #[inline(always)]
    fn around<const TAPS: usize>(&self, y: usize, height: usize) -> [&[f32]; TAPS] {
        std::array::from_fn(|at| {
            let row = (y + at).saturating_sub(TAPS / 2);
            self.row(row.min(height - 1))
        })
    }
}

/// Turns pictures into planes and gradients; keeps its buffers.
#[derive(Debug)]
pub(super) struct Extractor {
    logarithms: [f32; 256],
    fine: [f32; FINE_TAPS],
    rest: [f32; REST_TAPS],
    light: Rows,
    fine_rows: Rows,
    blurred: Rows,
    coarse_rows: Rows,
    plane: Rows,
}

impl Default for Extractor {
    fn default() -> Self {
        Self {
            logarithms: std::array::from_fn(|level| (level as f32 + DARK).ln()),
            fine: gaussian(FINE),
            // Blurring twice adds the variances.
            rest: gaussian((COARSE * COARSE - FINE * FINE).sqrt()),
            light: Rows::default(),
            fine_rows: Rows::default(),
            blurred: Rows::default(),
            coarse_rows: Rows::default(),
            plane: Rows::default(),
        }
    }
}

impl Extractor {
    /// The fine structure of a picture's brightness.
    pub(super) fn structure(&mut self, luma: &GrayImage, out: &mut Plane) {
        let (width, height) = (luma.width() as usize, luma.height() as usize);
        (out.width, out.height) = (width, height);
        out.values.resize(width * height, 0.0);
        let needs = Needs::from_gradients(Region::whole(luma.dimensions()));
        self.run(luma, &needs, out);
    }

    /// The gradients of the fine structure, where they are needed; 0 at the picture's border.
    pub(super) fn gradients(&mut self, luma: &GrayImage, needs: &Needs, out: &mut Gradients) {
        out.resize(luma.width() as usize, luma.height() as usize);
        self.run(luma, needs, out);
    }

    fn run<T: TakesRows>(&mut self, luma: &GrayImage, needs: &Needs, sink: &mut T) {
        if luma.width() == 0 || luma.height() == 0 {
            return;
        }
        let width = luma.width() as usize;
        self.light.resize(1, width);
        self.fine_rows.resize(FINE_TAPS, width);
        // A row is there until what is coarser of it is.
        self.blurred.resize(REST_RADIUS + 1, width);
        self.coarse_rows.resize(REST_TAPS, width);
        self.plane.resize(3, width);
        Arch::new().dispatch(Structure {
            extractor: self,
            luma,
            needs,
            sink,
        });
    }
}

/// What is done with a plane's rows, from top to bottom.
trait TakesRows {
    /// Row `y` is made; of those before it two are there.
    fn take(&mut self, y: usize, rows: &Rows, needs: &Needs);
}

impl TakesRows for Plane {
    #[inline(always)]
    fn take(&mut self, y: usize, rows: &Rows, _: &Needs) {
        let row = &rows.row(y)[MARGIN..MARGIN + self.width];
        self.values[y * self.width..(y + 1) * self.width].copy_from_slice(row);
    }
}

impl TakesRows for Gradients {
    #[inline(always)]
    fn take(&mut self, y: usize, rows: &Rows, needs: &Needs) {
        let (width, height) = (self.width, self.height);
        if y == 0 || y + 1 == height {
            let columns = needs.gradients.row(y);
            self.row_mut(y)[columns].fill([0.0; 2]);
        }
        // That of the row before is known now.
        let Some(y) = y.checked_sub(1).filter(|&y| y > 0) else {
            return;
        };
        let columns = needs.gradients.row(y);
        let row = self.row_mut(y);
        if width < 3 {
            return row[columns].fill([0.0; 2]);
        }
        let [above, here, below] = [y - 1, y, y + 1].map(|y| &rows.row(y)[MARGIN..MARGIN + width]);
        gradients(columns, [above, here, below], row);
    }
}

/// The making of one plane, compiled for the kind of processor: row by row, each as soon as what it is made of is
/// there, so that all of it stays in the processor's cache.
struct Structure<'a, T> {
    extractor: &'a mut Extractor,
    luma: &'a GrayImage,
    needs: &'a Needs,
    sink: &'a mut T,
}

impl<T: TakesRows> WithSimd for Structure<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self {
            extractor,
            luma,
            needs,
            sink,
        } = self;
        let height = luma.height() as usize;
        for at in 0..height + FINE_RADIUS + REST_RADIUS {
            if at < height {
                extractor.take_row(luma, at, needs);
            }
            if let Some(y) = at.checked_sub(FINE_RADIUS).filter(|&y| y < height) {
                extractor.blur_row(y, luma, needs);
            }
            if let Some(y) = at.checked_sub(FINE_RADIUS + REST_RADIUS) {
                extractor.finish_row(y, height, needs);
                sink.take(y, &extractor.plane, needs);
            }
        }
    }
}

impl Extractor {
    /// A row's light, and what is finer of it across.
    #[inline(always)]
    fn take_row(&mut self, luma: &GrayImage, y: usize, needs: &Needs) {
        let width = luma.width() as usize;
        let columns = needs.luma.row(y);
        let levels = luma.as_raw().get(y * width..(y + 1) * width);
        let levels = levels.unwrap_or_default().get(columns.clone());
        let light = self.light.row_mut(0);
        let values = light[MARGIN + columns.start..].iter_mut();
        for (value, &level) in values.zip(levels.unwrap_or_default()) {
            *value = self.logarithms[usize::from(level)];
        }
        continue_beyond(light, &columns, width);
        let columns = needs.fine_rows.row(y);
        filter_across(light, &self.fine, columns, self.fine_rows.row_mut(y));
    }

    /// The finer light of a row, and what is coarser of it across.
    #[inline(always)]
    fn blur_row(&mut self, y: usize, luma: &GrayImage, needs: &Needs) {
        let columns = needs.fine.row(y);
        let lines = self.fine_rows.around(y, luma.height() as usize);
        let blurred = self.blurred.row_mut(y);
        filter_down(lines, &self.fine, &columns, blurred);
        continue_beyond(blurred, &columns, luma.width() as usize);
        let columns = needs.coarse_rows.row(y);
        filter_across(blurred, &self.rest, columns, self.coarse_rows.row_mut(y));
    }

    /// What the finer light of a row has and the coarser has not.
    #[inline(always)]
    fn finish_row(&mut self, y: usize, height: usize, needs: &Needs) {
        let columns = needs.plane.row(y);
        let lines = self.coarse_rows.around(y, height);
        let plane = self.plane.row_mut(y);
        filter_down(lines, &self.rest, &columns, plane);
        let columns = MARGIN + columns.start..MARGIN + columns.end;
        let fine = &self.blurred.row(y)[columns.clone()];
        for (coarse, fine) in plane[columns].iter_mut().zip(fine) {
            *coarse = fine - *coarse;
        }
    }
}

/// Continues the picture's border on both sides, where these columns of a row reach it.
#[inline(always)]
fn continue_beyond(row: &mut [f32], columns: &Range<usize>, width: usize) {
    if columns.is_empty() {
        return;
    }
    if columns.start == 0 {
        let first = row[MARGIN];
        row[..MARGIN].fill(first);
    }
    if columns.end == width {
        let last = row[MARGIN + width - 1];
        row[MARGIN + width..].fill(last);
    }
}

/// Filters these columns of a row.
#[inline(always)]
fn filter_across<const TAPS: usize>(
    row: &[f32],
    kernel: &[f32; TAPS],
    columns: Range<usize>,
    to: &mut [f32],
) {
    let start = MARGIN + columns.start - TAPS / 2;
    let lines = std::array::from_fn(|at| &row[start + at..start + at + columns.len()]);
    weigh(
        lines,
        kernel,
        &mut to[MARGIN + columns.start..MARGIN + columns.end],
    );
}

/// Filters rows down, in these columns.
#[inline(always)]
fn filter_down<const TAPS: usize>(
    rows: [&[f32]; TAPS],
    kernel: &[f32; TAPS],
    columns: &Range<usize>,
    to: &mut [f32],
) {
    let columns = MARGIN + columns.start..MARGIN + columns.end;
    let lines = rows.map(|row| &row[columns.clone()]);
    weigh(lines, kernel, &mut to[columns]);
}

impl Gradients {
    /// The gradient of a pixel; `None` beyond the picture.
    pub(super) fn at(&self, x: u32, y: u32) -> Option<[f32; 2]> {
        let (x, y) = (x as usize, y as usize);
        let inside = x < self.width && y < self.height;
        let found = inside.then(|| self.values.get(y * self.width + x))?;
        found.copied()
    }

    fn resize(&mut self, width: usize, height: usize) {
        (self.width, self.height) = (width, height);
        self.values.resize(width * height, [0.0; 2]);
    }

    fn row_mut(&mut self, y: usize) -> &mut [[f32; 2]] {
        &mut self.values[y * self.width..(y + 1) * self.width]
    }

    /// Replaces these by the gradients of `plane`; 0 at its border.
    pub(super) fn take(&mut self, plane: &Plane) {
        self.resize(plane.width, plane.height);
        Arch::new().dispatch(Taking(self, plane));
    }
}

/// The making of gradients, compiled for the kind of processor.
struct Taking<'a>(&'a mut Gradients, &'a Plane);

impl WithSimd for Taking<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self(to, plane) = self;
        let (width, height) = (plane.width, plane.height);
        for (y, row) in (0..).zip(to.values.chunks_exact_mut(width.max(1))) {
            if width < 3 || y == 0 || y + 1 == height as isize {
                row.fill([0.0; 2]);
            } else {
                let rows = [plane.row(y - 1), plane.row(y), plane.row(y + 1)];
                gradients(0..width, rows, row);
            }
        }
    }
}

/// The gradients of a row of three columns or more, in some of them, by the rows around it.
#[inline(always)]
fn gradients(columns: Range<usize>, [above, here, below]: [&[f32]; 3], row: &mut [[f32; 2]]) {
    let last = row.len() - 1;
    let inner = columns.start.max(1)..columns.end.min(last);
    if columns.contains(&0) {
        row[0] = [0.0; 2];
    }
    if columns.contains(&last) {
        row[last] = [0.0; 2];
    }
    if inner.is_empty() {
        return;
    }
    let shifted = |by: usize| &here[inner.start + by - 1..inner.end + by - 1];
    let across = shifted(2).iter().zip(shifted(0));
    let down = below[inner.clone()].iter().zip(&above[inner.clone()]);
    for ((gradient, (right, left)), (below, above)) in row[inner].iter_mut().zip(across).zip(down) {
        *gradient = [0.5 * (right - left), 0.5 * (below - above)];
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

/// A Gaussian of this standard deviation, cut off at both ends; its sum is 1.
fn gaussian<const TAPS: usize>(deviation: f32) -> [f32; TAPS] {
    let radius = (TAPS / 2) as f32;
    let values: [f32; TAPS] =
        std::array::from_fn(|at| (-0.5 * ((at as f32 - radius) / deviation).powi(2)).exp());
    let sum: f32 = values.iter().sum();
    values.map(|value| value / sum)
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
    use image::Luma;
    use proptest::prelude::*;

    use super::*;

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

    /// Both filters over the whole picture, as they are defined.
    fn by_definition(luma: &GrayImage) -> Plane {
        let extractor = Extractor::default();
        let (width, height) = (luma.width() as usize, luma.height() as usize);
        let filtered = |from: &dyn Fn(usize, usize) -> f32, kernel: &[f32]| {
            let radius = kernel.len() / 2;
            let sum = |at: usize, last: usize, from: &dyn Fn(usize) -> f32| {
                let near = |tap: usize| (at + tap).saturating_sub(radius).min(last);
                let taps = kernel.iter().enumerate();
                taps.fold(0.0, |sum, (tap, weight)| sum + weight * from(near(tap)))
            };
            let row = |y: usize| (0..width).map(move |x| sum(x, width - 1, &|x| from(x, y)));
            let rows: Vec<f32> = (0..height).flat_map(row).collect();
            let column = |x: usize, y: usize| sum(y, height - 1, &|y| rows[y * width + x]);
            let all = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
            all.map(|(x, y)| column(x, y)).collect::<Vec<f32>>()
        };
        let level = |x: usize, y: usize| usize::from(luma.as_raw()[y * width + x]);
        let fine = filtered(&|x, y| extractor.logarithms[level(x, y)], &extractor.fine);
        let coarse = filtered(&|x, y| fine[y * width + x], &extractor.rest);
        let values = fine.iter().zip(coarse).map(|(fine, coarse)| fine - coarse);
        Plane {
            width,
            height,
            values: values.collect(),
        }
    }

    proptest! {
        #[test]
        fn planes_and_gradients_are_those_of_the_definition_wherever_they_are_needed(
            (width, height) in (1_u32..40, 1_u32..30),
            seed in prop::collection::vec(any::<u8>(), 1200),
            pixels in prop::collection::vec((0_u32..40, 0_u32..30), 1..6),
            by in 0_usize..4,
        ) {
            let size = (width, height);
            let luma = GrayImage::from_fn(width, height, |x, y| Luma([seed[(40 * y + x) as usize]]));
            let wanted = by_definition(&luma);
            let mut extractor = Extractor::default();
            let mut plane = Plane::default();
            extractor.structure(&luma, &mut plane);
            prop_assert_eq!(&plane.values, &wanted.values);
            let [mut all, mut some] = [Gradients::default(), Gradients::default()];
            all.take(&plane);
            let pixels = pixels.into_iter().filter(|&(x, y)| x < width && y < height);
            let region = Region::around(pixels, by, size);
            some.resize(width as usize, height as usize);
            // What is not made must not be read.
            some.values.fill([f32::NAN; 2]);
            extractor.gradients(&luma, &Needs::from_gradients(region.clone()), &mut some);
            for y in 0..height as usize {
                for x in region.row(y) {
                    let at = (x as u32, y as u32);
                    prop_assert_eq!(some.at(at.0, at.1), all.at(at.0, at.1), "{:?}", at);
                }
            }
        }
    }
}
