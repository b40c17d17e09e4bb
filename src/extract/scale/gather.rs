//! One pass over a crop's rows: each is masked and turned to light, added to the output rows that it belongs
//! to, and these are filtered across when they are complete.
//!
//! The loops are written so that they become vector instructions, for the kind of processor that runs them.
//! They add and multiply in the same order on each, so that the result is the same everywhere.

use std::ops::Range;

use image::{GrayImage, RgbImage};
use pulp::{Arch, Simd, WithSimd};

use super::filter::Axis;
use super::light::{Srgb, linear};
use crate::CropView;
use relit_data::image_stats::Measuring;

/// Red, green, blue and the mask's share.
const PLANES: usize = 4;

/// Pixels that are needed around a crop to move it by part of a pixel.
pub const APRON: u32 = 3;

/// The mask of the crops, prepared for reading their rows.
#[derive(Debug)]
pub(super) struct SourceMask {
    /// 0 or 255.
    pub(super) image: GrayImage,
    /// For each row, the columns from the first under the mask to the last.
    hulls: Vec<Range<usize>>,
}

impl SourceMask {
    pub(super) fn new(image: GrayImage) -> Self {
        let hull = |row: &[u8]| {
            let start = row.iter().position(|&m| m != 0).unwrap_or_default();
            let end = row.iter().rposition(|&m| m != 0);
            start..end.map_or(start, |last| last + 1)
        };
        let width = image.width().max(1) as usize;
        Self {
            hulls: image.as_raw().chunks_exact(width).map(hull).collect(),
            image,
        }
    }
}

/// What a thread needs to scale crops; it keeps its memory from frame to frame.
#[derive(Debug, Default)]
pub struct ScaleBuffers {
    /// A row of the crop.
    light: [Vec<f32>; PLANES],
    /// Output rows before they are filtered across; each is used again for later ones.
    sums: Vec<[Vec<f32>; PLANES]>,
}

/// The gathering of one crop's pixels.
pub(super) struct Gather<'a> {
    pub(super) source: &'a SourceMask,
    /// The mask of the scaled image.
    pub(super) mask: &'a GrayImage,
    pub(super) srgb: &'a Srgb,
    pub(super) crop: CropView<'a>,
    pub(super) across: &'a Axis,
    pub(super) down: &'a Axis,
    /// 1 / the filtered mask; `None` if it is gathered with the pixels.
    pub(super) gain: Option<&'a [f32]>,
    /// How far the object lies beside the mask; the axes count from an apron outside the crop then.
    pub(super) part: Option<[f64; 2]>,
}

struct Run<'a, 'm> {
    gather: Gather<'a>,
    buffers: &'a mut ScaleBuffers,
    measuring: &'a mut Measuring<'m>,
}

impl Gather<'_> {
    /// Gathers all rows, and measures those of the crop.
    pub(super) fn run(self, buffers: &mut ScaleBuffers, measuring: &mut Measuring<'_>) -> RgbImage {
        Arch::new().dispatch(Run {
            gather: self,
            buffers,
            measuring,
        })
    }

    fn apron(&self) -> u32 {
        match self.part {
            Some(_) => APRON,
            None => 0,
        }
    }

    /// The columns of a row, with the apron, that hold light, and may hold 0.
    fn columns(&self, row: i64) -> Range<usize> {
        let hull = |row: i64| {
            let at = usize::try_from(row).ok();
            let hull = at.and_then(|at| self.source.hulls.get(at)).cloned();
            hull.filter(|hull| !hull.is_empty())
        };
        let Some(_) = self.part else {
            return hull(row).unwrap_or_default();
        };
        // A moved mask reaches one pixel further.
        let around = [row - 1, row, row + 1].into_iter().filter_map(hull);
        let joined = around.reduce(|a, b| a.start.min(b.start)..a.end.max(b.end));
        let apron = APRON as usize;
        joined.map_or(0..0, |hull| hull.start + apron - 1..hull.end + apron + 1)
    }
}

impl WithSimd for Run<'_, '_> {
    type Output = RgbImage;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> RgbImage {
        let Self {
            gather,
            buffers,
            measuring,
        } = self;
        let apron = gather.apron();
        let (width, height) = gather.crop.dimensions();
        let source = (width + 2 * apron) as usize;
        let planes = match gather.gain {
            Some(_) => PLANES - 1,
            None => PLANES,
        };
        let ring = gather.down.overlap().max(1);
        buffers.reset(source + gather.across.taps(), ring);
        let mask = gather.mask;
        let mut scaled = RgbImage::new(mask.width(), mask.height());
        let (mut first, mut next) = (0, 0);
        for at in 0..(height + 2 * apron) as usize {
            let y = at as i64 - i64::from(apron);
            let row = gather.crop.row(y, apron);
            if (0..i64::from(height)).contains(&y) {
                measuring.add_row::<4>(gather.crop.row(y, 0));
            }
            while next < gather.down.outputs() && gather.down.window(next).0 <= at {
                for plane in &mut buffers.sums[next % ring] {
                    plane.fill(0.0);
                }
                next += 1;
            }
            let columns = gather.columns(y);
            if !columns.is_empty() {
                light_of(
                    &row[4 * columns.start..4 * columns.end],
                    &columns,
                    &mut buffers.light,
                );
                match gather.part {
                    None => cut_out(
                        gather.source.image.as_raw(),
                        at * source,
                        &columns,
                        &mut buffers.light,
                    ),
                    Some(part) => {
                        share(&gather.source.image, part, y, &columns, &mut buffers.light)
                    }
                }
                for output in first..next {
                    let (start, weights) = gather.down.window(output);
                    let weight = weights[at - start];
                    let sums = &mut buffers.sums[output % ring];
                    for (sum, light) in sums.iter_mut().zip(&buffers.light).take(planes) {
                        add_scaled(&mut sum[columns.clone()], &light[columns.clone()], weight);
                    }
                }
            }
            while first < next && gather.down.end(first) <= at + 1 {
                gather.finish(first, &buffers.sums[first % ring], &mut scaled);
                first += 1;
            }
        }
        scaled
    }
}

impl Gather<'_> {
    /// Filters an output row across.
    #[inline(always)]
    fn finish(&self, output: usize, sums: &[Vec<f32>; PLANES], scaled: &mut RgbImage) {
        let mask = self.mask;
        let width = mask.width() as usize;
        let row = output * width..(output + 1) * width;
        let pixels = scaled
            .get_mut(3 * row.start..3 * row.end)
            .unwrap_or_default();
        let mask = mask.as_raw().get(row.clone()).unwrap_or_default();
        for ((x, pixel), mask) in pixels.chunks_exact_mut(3).enumerate().zip(mask) {
            if *mask == 0 {
                continue;
            }
            let (start, weights) = self.across.window(x);
            let filtered = |plane: &Vec<f32>| dot(weights, &plane[start..start + weights.len()]);
            let [red, green, blue, shares] = sums;
            let gain = match self.gain {
                Some(gain) => gain[row.start + x],
                // Where nothing of the moved object is left, the pixel stays 0.
                None => 1.0 / filtered(shares).max(1e-5),
            };
            for (value, plane) in pixel.iter_mut().zip([red, green, blue]) {
                *value = self.srgb.value(gain * filtered(plane));
            }
        }
    }
}

impl ScaleBuffers {
    fn reset(&mut self, length: usize, ring: usize) {
        let all = self.sums.iter_mut().flatten().chain(&mut self.light);
        for plane in all.filter(|plane| plane.len() != length) {
            plane.clear();
            plane.resize(length, 0.0);
        }
        self.sums
            .resize_with(ring, || std::array::from_fn(|_| vec![0.0; length]));
    }
}

/// The light of a run of pixels, at their columns.
#[inline(always)]
fn light_of(pixels: &[u8], columns: &Range<usize>, light: &mut [Vec<f32>; PLANES]) {
    // One channel at a time: the processor has too few registers for three.
    for (channel, plane) in (0..3).zip(light) {
        let plane = &mut plane[columns.clone()];
        for (pixel, light) in pixels.chunks_exact(4).zip(plane) {
            let all = u32::from_le_bytes([pixel[0], pixel[1], pixel[2], pixel[3]]);
            *light = linear((all >> (8 * channel)) & 255);
        }
    }
}

/// Sets the light outside the mask to 0; the mask's row begins at `start`.
#[inline(always)]
fn cut_out(mask: &[u8], start: usize, columns: &Range<usize>, light: &mut [Vec<f32>; PLANES]) {
    let mask = &mask[start + columns.start..start + columns.end];
    let [red, green, blue, _] = light;
    for plane in [red, green, blue] {
        for (light, mask) in plane[columns.clone()].iter_mut().zip(mask) {
            *light = if *mask != 0 { *light } else { 0.0 };
        }
    }
}

/// Multiplies the light by the share of the mask, moved by part of a pixel, in each pixel of row `y`; notes
/// the shares.
#[inline(always)]
fn share(
    mask: &GrayImage,
    [dx, dy]: [f64; 2],
    y: i64,
    columns: &Range<usize>,
    light: &mut [Vec<f32>; PLANES],
) {
    let (whole_x, whole_y) = ((-dx).floor(), (-dy).floor());
    let (right, lower) = ((-dx - whole_x) as f32, (-dy - whole_y) as f32);
    let width = mask.width() as usize;
    let row = |y: i64| {
        let at = usize::try_from(y).unwrap_or(usize::MAX);
        let row = at
            .checked_mul(width)
            .and_then(|start| mask.as_raw().get(start..start.checked_add(width)?));
        row.unwrap_or_default()
    };
    let (above, below) = (row(y + whole_y as i64), row(y + whole_y as i64 + 1));
    let [red, green, blue, shares] = light;
    let shares = &mut shares[columns.clone()];
    shares.fill(0.0);
    for (row, down) in [(above, 1.0 - lower), (below, lower)] {
        for (step, across) in [(0, 1.0 - right), (1, right)] {
            // The column of the mask that belongs to the first of these.
            let first = columns.start as i64 - i64::from(APRON) + whole_x as i64 + step;
            let skipped = usize::try_from(-first).unwrap_or_default();
            let row = row
                .get(usize::try_from(first).unwrap_or_default()..)
                .unwrap_or_default();
            let weight = down * across / 255.0;
            for (share, mask) in shares.iter_mut().skip(skipped).zip(row) {
                *share += weight * f32::from(*mask);
            }
        }
    }
    for plane in [red, green, blue] {
        for (light, share) in plane[columns.clone()].iter_mut().zip(shares.iter()) {
            *light *= share;
        }
    }
}

/// `to += weight * from`.
#[inline(always)]
fn add_scaled(to: &mut [f32], from: &[f32], weight: f32) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += weight * from;
    }
}

/// The sum of products; the lengths are a multiple of four.
#[inline(always)]
fn dot(weights: &[f32], values: &[f32]) -> f32 {
    let mut lanes = [0.0; 4];
    for (weights, values) in weights.chunks_exact(4).zip(values.chunks_exact(4)) {
        for ((lane, weight), value) in lanes.iter_mut().zip(weights).zip(values) {
            *lane += weight * value;
        }
    }
    (lanes[0] + lanes[2]) + (lanes[1] + lanes[3])
}
