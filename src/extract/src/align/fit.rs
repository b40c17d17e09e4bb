//! The place at which a picture's gradients fit a template: Gauss-Newton steps on robust weights.
//!
//! With a shift s, r(x) = G(x + s) - T(x) is, to the first order, T's change times the error of s. Each
//! pixel counts by its trust, and the less the more its r exceeds its usual deviation (Geman and
//! McClure's weights): a passing highlight is not mistaken for movement.

use pulp::{Arch, Simd, WithSimd};

use super::structure::{Gradients, cubic};
use super::template::{Template, TemplatePixel};

/// Steps; fewer where it stands still.
const MAX_STEPS: usize = 8;
/// Largest step, pixels: beyond, the first order does not hold.
const MAX_STEP: f64 = 1.0;
/// Deviations at which a pixel's weight is a quarter.
const OUTLIER: f32 = 1.5;
/// The same for a rotation or growth, which the shift leaves in the residuals.
const FAR_OUTLIER: f32 = 6.0;
/// Fewest pixels from which a shift is measured.
const MIN_PIXELS: usize = 60;
/// Pixels from which a rotation and a growth are measured.
const SIMILARITY_PIXELS: usize = 3000;
/// Pixels that are looked at in a search.
const SEARCH_PIXELS: usize = 1000;
/// The object has structure in one direction only if the other has less than this part of its weight.
const MIN_CROSS: f64 = 1e-3;

/// A shift that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fit {
    /// To the right and down, pixels.
    pub(super) shift: [f64; 2],
    /// Correlation of the gradients there, -1..=1.
    pub(super) correlation: f64,
    /// Standard deviation of the shift, pixels.
    pub(super) uncertainty: f64,
}

/// How an object is turned and scaled, beside its shift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Similarity {
    /// Clockwise, radians.
    pub(super) turned: f64,
    /// Growth, 0 is none.
    pub(super) grown: f64,
    /// Mean distance of the object's pixels from their centre, pixels.
    pub(super) radius: f64,
}

/// What is summed over the pixels: the normal matrix (xx, xy, yy) and the right side of one step, and the
/// products of the correlation (template, frame, both).
const TERMS: usize = 8;
/// The first of the right side.
const RIGHT: usize = 3;
/// The normal equations of one step, and what goes with them.
#[derive(Default)]
struct Sums {
    count: usize,
    terms: [f64; TERMS],
    /// Products of what single pieces add to the right side: xx, xy, yy.
    scatter: [f64; 3],
}

impl Template {
    /// The fit nearest to `start`, up to a last step of less than `still`; `None` if no fit lies within
    /// `reach` pixels.
    pub(super) fn fit(
        &self,
        frame: &Gradients,
        start: [f64; 2],
        reach: f64,
        still: f64,
    ) -> Option<Fit> {
        let mut shift = start;
        let mut sums = self.sums(frame, shift);
        for step in 1..=MAX_STEPS {
            let [dx, dy] = sums.step()?;
            shift = [shift[0] - dx, shift[1] - dy];
            if shift[0].abs().max(shift[1].abs()) > reach {
                return None;
            }
            // So small a last step changes nothing that the sums say.
            if dx.abs().max(dy.abs()) < still || step == MAX_STEPS {
                break;
            }
            sums = self.sums(frame, shift);
        }
        Some(Fit {
            shift,
            correlation: sums.correlation(),
            uncertainty: sums.uncertainty(),
        })
    }

    /// The best whole-pixel shift within `reach`.
    pub(super) fn search(&self, frame: &Gradients, reach: f64) -> [f64; 2] {
        let reach = reach.ceil() as i32;
        let places = (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy)));
        let mut best = (f64::NEG_INFINITY, [0.0; 2]);
        let every = self.pixels.len().div_ceil(SEARCH_PIXELS).max(1);
        for (dx, dy) in places {
            let mut sums = Sums::default();
            for pixel in self.pixels.iter().step_by(every) {
                // What lies beyond the picture agrees with nothing, so that the rest cannot win alone.
                let found = frame.at(
                    pixel.x.wrapping_add_signed(dx),
                    pixel.y.wrapping_add_signed(dy),
                );
                sums.compare(pixel, found.unwrap_or_default());
            }
            if sums.correlation() > best.0 {
                best = (sums.correlation(), [f64::from(dx), f64::from(dy)]);
            }
        }
        best.1
    }

    /// The part of the object that agrees with the frame, by what its pixels say about a shift, 0..=1.
    pub(super) fn agreement(&self, frame: &Gradients, shift: [f64; 2]) -> f64 {
        let sampler = Sampler::new(frame, shift);
        let [mut agrees, mut all] = [0.0; 2];
        for pixel in &self.pixels {
            let weight = sampler
                .at(pixel)
                .map_or(0.0, |found| weighed(pixel, found, OUTLIER).0);
            agrees += f64::from(weight);
            all += f64::from(pixel.weight);
        }
        agrees / all
    }

    /// What a rotation and a growth about the object's centre explain beyond the shift.
    pub(super) fn similarity(&self, frame: &Gradients, shift: [f64; 2]) -> Option<Similarity> {
        let every = self.pixels.len().div_ceil(SIMILARITY_PIXELS).max(1);
        let pixels = || self.pixels.iter().step_by(every);
        let count = pixels().count().max(1) as f64;
        let sum = |of: fn(&TemplatePixel) -> u32| -> f64 {
            pixels().map(|pixel| f64::from(of(pixel))).sum()
        };
        let centre = (sum(|p| p.x) / count, sum(|p| p.y) / count);
        let SimilaritySums {
            normal,
            right,
            distance,
        } = Arch::new().dispatch(SummingSimilarity {
            pixels: pixels(),
            sampler: Sampler::new(frame, shift),
            centre,
        });
        let [_, _, turned, grown] = solved(normal, right)?;
        // The residual is that of the template's place minus the frame's.
        Some(Similarity {
            turned: -turned,
            grown: -grown,
            radius: distance / count,
        })
    }

    fn sums(&self, frame: &Gradients, shift: [f64; 2]) -> Sums {
        Arch::new().dispatch(Summing {
            template: self,
            sampler: Sampler::new(frame, shift),
        })
    }
}

/// A loop over a template's pixels, compiled for the kind of processor.
struct Summing<'a> {
    template: &'a Template,
    sampler: Sampler<'a>,
}

impl WithSimd for Summing<'_> {
    type Output = Sums;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Sums {
        let mut sums = Sums::default();
        // Within a piece, single precision suffices.
        for pixels in self.template.pixels.chunks(self.template.piece.max(1)) {
            let mut piece = [0.0_f32; TERMS];
            for pixel in pixels {
                if let Some(found) = self.sampler.at(pixel) {
                    for (sum, term) in piece.iter_mut().zip(terms(pixel, found)) {
                        *sum += term;
                    }
                    sums.count += 1;
                }
            }
            for (sum, part) in sums.terms.iter_mut().zip(piece) {
                *sum += f64::from(part);
            }
            let [right, down] = [piece[RIGHT], piece[RIGHT + 1]].map(f64::from);
            let [xx, xy, yy] = &mut sums.scatter;
            *xx += right * right;
            *xy += right * down;
            *yy += down * down;
        }
        sums
    }
}

/// The normal equations of shift, rotation and growth, and the sum of the distances from the centre.
#[derive(Default)]
struct SimilaritySums {
    normal: [[f64; 4]; 4],
    right: [f64; 4],
    distance: f64,
}

/// As [`Summing`], for a rotation and a growth about a centre.
struct SummingSimilarity<'a, I> {
    pixels: I,
    sampler: Sampler<'a>,
    centre: (f64, f64),
}

impl<'a, I: Iterator<Item = &'a TemplatePixel>> WithSimd for SummingSimilarity<'_, I> {
    type Output = SimilaritySums;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> SimilaritySums {
        let mut sums = SimilaritySums::default();
        for pixel in self.pixels {
            let Some(found) = self.sampler.at(pixel) else {
                continue;
            };
            let x = f64::from(pixel.x) - self.centre.0;
            let y = f64::from(pixel.y) - self.centre.1;
            sums.distance += (x * x + y * y).sqrt();
            let (weight, residual) = weighed(pixel, found, FAR_OUTLIER);
            let weight = f64::from(weight);
            let [xx, xy, yy] = pixel.change.map(f64::from);
            for (residual, [jx, jy]) in residual.into_iter().zip([[xx, xy], [xy, yy]]) {
                let row = [jx, jy, x * jy - y * jx, x * jx + y * jy];
                for ((a, right), normal) in row.iter().zip(&mut sums.right).zip(&mut sums.normal) {
                    *right += weight * a * f64::from(residual);
                    for (b, normal) in row.iter().zip(normal) {
                        *normal += weight * a * b;
                    }
                }
            }
        }
        sums
    }
}

/// The robust weight of a pixel, a quarter at `outlier` deviations, and its residual.
#[inline(always)]
fn weighed(pixel: &TemplatePixel, found: [f32; 2], outlier: f32) -> (f32, [f32; 2]) {
    let [x, y] = pixel.gradient;
    let residual = [found[0] - x, found[1] - y];
    let square = residual[0] * residual[0] + residual[1] * residual[1];
    let fall = 1.0 + square * pixel.trust / (outlier * outlier);
    (pixel.weight / (fall * fall), residual)
}

/// What a pixel adds to the sums.
#[inline(always)]
fn terms(pixel: &TemplatePixel, found: [f32; 2]) -> [f32; TERMS] {
    let (weight, [rx, ry]) = weighed(pixel, found, OUTLIER);
    let [xx, xy, yy] = pixel.change;
    let (right, down) = (weight * (xx * rx + xy * ry), weight * (xy * rx + yy * ry));
    let [template, frame, product] = compared(pixel, found);
    [
        weight * (xx * xx + xy * xy),
        weight * (xx * xy + xy * yy),
        weight * (xy * xy + yy * yy),
        right,
        down,
        template,
        frame,
        product,
    ]
}

/// What a pixel adds to the products of the correlation.
#[inline(always)]
fn compared(pixel: &TemplatePixel, found: [f32; 2]) -> [f32; 3] {
    let [tx, ty] = pixel.gradient;
    [
        pixel.trust * (tx * tx + ty * ty),
        pixel.trust * (found[0] * found[0] + found[1] * found[1]),
        pixel.trust * (tx * found[0] + ty * found[1]),
    ]
}

impl Sums {
    /// Adds to the sums of the correlation.
    fn compare(&mut self, pixel: &TemplatePixel, found: [f32; 2]) {
        let [.., template, frame, product] = &mut self.terms;
        let parts = compared(pixel, found);
        for (sum, part) in [template, frame, product].into_iter().zip(parts) {
            *sum += f64::from(part);
        }
    }

    /// The normal matrix and its determinant; `None` if the object does not say a shift in both directions.
    fn normal(&self) -> Option<([f64; 3], f64)> {
        let [xx, xy, yy, ..] = self.terms;
        let determinant = xx * yy - xy * xy;
        let size = xx + yy;
        let enough = self.count >= MIN_PIXELS && determinant > MIN_CROSS * size * size;
        enough.then_some(([xx, xy, yy], determinant))
    }

    /// The error of the shift.
    fn step(&self) -> Option<[f64; 2]> {
        let ([xx, xy, yy], determinant) = self.normal()?;
        let [_, _, _, right, down, ..] = self.terms;
        let dx = (yy * right - xy * down) / determinant;
        let dy = (xx * down - xy * right) / determinant;
        Some([dx, dy].map(|step| step.clamp(-MAX_STEP, MAX_STEP)))
    }

    /// The standard deviation of the shift: the "sandwich" of the normal matrix and the scatter of the right side
    /// (Huber, "The behavior of maximum likelihood estimates under nonstandard conditions", 1967), by pieces of
    /// the object.
    fn uncertainty(&self) -> f64 {
        let Some(([xx, xy, yy], determinant)) = self.normal() else {
            return f64::INFINITY;
        };
        let [sxx, sxy, syy] = self.scatter;
        // The rows of the inverse of the normal matrix.
        let variance = |a: f64, b: f64| (a * a * sxx + 2.0 * a * b * sxy + b * b * syy).max(0.0);
        let across = variance(yy / determinant, -xy / determinant);
        let down = variance(-xy / determinant, xx / determinant);
        (across + down).sqrt()
    }

    fn correlation(&self) -> f64 {
        let [.., template, frame, product] = self.terms;
        let scale = (template * frame).sqrt();
        if scale > 0.0 { product / scale } else { 0.0 }
    }
}

/// Reads gradients at a shift, between pixels by cubic convolution.
struct Sampler<'a> {
    frame: &'a Gradients,
    offset: (i64, i64),
    across: [f32; 4],
    down: [f32; 4],
}

impl<'a> Sampler<'a> {
    fn new(frame: &'a Gradients, [dx, dy]: [f64; 2]) -> Self {
        let (whole_x, whole_y) = (dx.floor(), dy.floor());
        Self {
            frame,
            offset: (whole_x as i64 - 1, whole_y as i64 - 1),
            across: cubic((dx - whole_x) as f32),
            down: cubic((dy - whole_y) as f32),
        }
    }

    /// The gradient at a pixel of the template; `None` beyond the picture.
    #[inline(always)]
    fn at(&self, pixel: &TemplatePixel) -> Option<[f32; 2]> {
        let x = usize::try_from(i64::from(pixel.x) + self.offset.0).ok()?;
        let y = usize::try_from(i64::from(pixel.y) + self.offset.1).ok()?;
        let width = self.frame.width;
        if x + 4 > width || y + 4 > self.frame.height {
            return None;
        }
        // Four gradients of each of four rows, both directions side by side.
        let start = y * width + x;
        let mut sums = [0.0_f32; 8];
        for (row, down) in (0..4).zip(self.down) {
            let from = start + row * width;
            let four = self.frame.values.get(from..from + 4)?.as_flattened();
            for (sum, value) in sums.iter_mut().zip(four) {
                *sum += down * value;
            }
        }
        let [a, b, c, d] = self.across;
        let [ax, ay, bx, by, cx, cy, dx, dy] = sums;
        Some([
            (a * ax + b * bx) + (c * cx + d * dx),
            (a * ay + b * by) + (c * cy + d * dy),
        ])
    }
}

/// The solution of four linear equations, by elimination with pivots; `None` if they do not have one.
fn solved(mut matrix: [[f64; 4]; 4], mut right: [f64; 4]) -> Option<[f64; 4]> {
    for at in 0..4 {
        let pivot = (at..4).max_by(|&a, &b| matrix[a][at].abs().total_cmp(&matrix[b][at].abs()))?;
        matrix.swap(at, pivot);
        right.swap(at, pivot);
        if matrix[at][at].abs() < 1e-12 {
            return None;
        }
        for below in at + 1..4 {
            let factor = matrix[below][at] / matrix[at][at];
            let pivot = matrix[at];
            for (to, from) in matrix[below].iter_mut().zip(pivot) {
                *to -= factor * from;
            }
            right[below] -= factor * right[at];
        }
    }
    for at in (0..4).rev() {
        let known: f64 = (at + 1..4)
            .map(|column| matrix[at][column] * right[column])
            .sum();
        right[at] = (right[at] - known) / matrix[at][at];
    }
    Some(right)
}
