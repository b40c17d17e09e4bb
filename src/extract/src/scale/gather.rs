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
    /// For each row, the runs of columns under the mask.
    runs: Vec<Vec<Range<usize>>>,
}

impl SourceMask {
    pub(super) fn new(image: GrayImage) -> Self {
        let width = image.width().max(1) as usize;
        let rows = || image.as_raw().chunks_exact(width);
        Self {
            hulls: rows().map(hull).collect(),
            runs: rows().map(runs).collect(),
            image,
        }
    }
}

/// The columns of a mask's row from the first that is not 0 to the last.
fn hull(row: &[u8]) -> Range<usize> {
    let start = row.iter().position(|&m| m != 0).unwrap_or_default();
    let end = row.iter().rposition(|&m| m != 0);
    start..end.map_or(start, |last| last + 1)
}

/// The runs of a mask's row that are not 0.
fn runs(row: &[u8]) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut at = 0;
    for run in row.chunk_by(|a, b| (*a != 0) == (*b != 0)) {
        if run[0] != 0 {
            runs.push(at..at + run.len());
        }
        at += run.len();
    }
    runs
}

/// What a thread needs to scale crops; it keeps its memory from frame to frame.
#[derive(Debug, Default)]
pub struct ScaleBuffers {
    /// A row of the crop.
    light: [Vec<f32>; PLANES],
    /// Output rows before they are filtered across; each is used again for later ones.
    sums: Vec<[Vec<f32>; PLANES]>,
    /// An output row before it is filtered across, its planes side by side.
    line: Vec<[f32; PLANES]>,
    /// Its light afterwards, and the levels of that.
    across: Vec<[f32; PLANES]>,
    levels: Vec<[u16; PLANES]>,
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

/// How far the gathering of a crop has come.
#[derive(Debug)]
pub(crate) struct Progress {
    pub(super) scaled: RgbImage,
    /// The next row, with the apron's.
    at: usize,
    /// Output rows that are begun and not complete.
    open: Range<usize>,
}

struct Run<'a, 'm> {
    gather: &'a Gather<'a>,
    until: usize,
    progress: &'a mut Progress,
    buffers: &'a mut ScaleBuffers,
    measuring: &'a mut Measuring<'m>,
}

impl Gather<'_> {
    /// Gathers all rows, and measures those of the crop.
    pub(super) fn run(self, buffers: &mut ScaleBuffers, measuring: &mut Measuring<'_>) -> RgbImage {
        let mut progress = self.begin(buffers);
        let (_, height) = self.crop.dimensions();
        let all = (height + 2 * self.apron()) as usize;
        self.advance(all, &mut progress, buffers, measuring);
        progress.scaled
    }

    /// Begins with a crop.
    pub(super) fn begin(&self, buffers: &mut ScaleBuffers) -> Progress {
        let (width, _) = self.crop.dimensions();
        let source = (width + 2 * self.apron()) as usize;
        buffers.reset(
            source + self.across.taps(),
            self.down.overlap().max(1),
            self.mask.width() as usize,
        );
        Progress {
            scaled: RgbImage::new(self.mask.width(), self.mask.height()),
            at: 0,
            open: 0..0,
        }
    }

    /// Gathers and measures the rows before row `until`, counted with the apron's.
    pub(super) fn advance(
        &self,
        until: usize,
        progress: &mut Progress,
        buffers: &mut ScaleBuffers,
        measuring: &mut Measuring<'_>,
    ) {
        Arch::new().dispatch(Run {
            gather: self,
            until,
            progress,
            buffers,
            measuring,
        });
    }

    fn apron(&self) -> u32 {
        match self.part {
            Some(_) => APRON,
            None => 0,
        }
    }

    /// The columns of a row, with the apron, that hold light of a moved crop, and may hold 0.
    fn columns(&self, row: i64) -> Range<usize> {
        let hull = |row: i64| {
            let at = usize::try_from(row).ok();
            let hull = at.and_then(|at| self.source.hulls.get(at)).cloned();
            hull.filter(|hull| !hull.is_empty())
        };
        // A moved mask reaches one pixel further.
        let around = [row - 1, row, row + 1].into_iter().filter_map(hull);
        let joined = around.reduce(|a, b| a.start.min(b.start)..a.end.max(b.end));
        let apron = APRON as usize;
        joined.map_or(0..0, |hull| hull.start + apron - 1..hull.end + apron + 1)
    }
}

impl WithSimd for Run<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self {
            gather,
            until,
            progress,
            buffers,
            measuring,
        } = self;
        let apron = gather.apron();
        let (_, height) = gather.crop.dimensions();
        let planes = match gather.gain {
            Some(_) => PLANES - 1,
            None => PLANES,
        };
        let ring = buffers.sums.len();
        let Progress {
            scaled,
            at: from,
            open,
        } = progress;
        for at in *from..until {
            let y = at as i64 - i64::from(apron);
            let row = gather.crop.row(y, apron);
            if (0..i64::from(height)).contains(&y) {
                measuring.add_row::<4>(gather.crop.row(y, 0));
            }
            while open.end < gather.down.outputs() && gather.down.window(open.end).0 <= at {
                for plane in buffers.sums[open.end % ring].iter_mut().take(planes) {
                    plane.fill(0.0);
                }
                open.end += 1;
            }
            match gather.part {
                None => {
                    for columns in gather.source.runs.get(at).into_iter().flatten() {
                        if open.len() == 2 {
                            gather.add_light(open.start, at, (row, columns), buffers);
                        } else {
                            light_of(row, columns, &mut buffers.light);
                            gather.add(open.clone(), at, columns, planes, buffers);
                        }
                    }
                }
                Some(part) => {
                    let columns = gather.columns(y);
                    if !columns.is_empty() {
                        light_of(row, &columns, &mut buffers.light);
                        share(&gather.source.image, part, y, &columns, &mut buffers.light);
                        gather.add(open.clone(), at, &columns, planes, buffers);
                    }
                }
            }
            while open.start < open.end && gather.down.end(open.start) <= at + 1 {
                gather.finish(open.start, buffers, scaled);
                open.start += 1;
            }
        }
        *from = until.max(*from);
    }
}

impl Gather<'_> {
    /// Adds the light of row `at` to these output rows, in these columns.
    #[inline(always)]
    fn add(
        &self,
        outputs: Range<usize>,
        at: usize,
        columns: &Range<usize>,
        planes: usize,
        ScaleBuffers { light, sums, .. }: &mut ScaleBuffers,
    ) {
        let ring = sums.len();
        for output in outputs {
            let weight = self.weight(output, at);
            let sums = &mut sums[output % ring];
            for (sum, light) in sums.iter_mut().zip(&*light).take(planes) {
                add_scaled(&mut sum[columns.clone()], &light[columns.clone()], weight);
            }
        }
    }

    /// Adds the light of row `at` to two output rows from `output` on, without keeping it: most rows belong to two.
    #[inline(always)]
    fn add_light(
        &self,
        output: usize,
        at: usize,
        (row, columns): (&[u8], &Range<usize>),
        ScaleBuffers { sums, .. }: &mut ScaleBuffers,
    ) {
        let outputs = [output, output + 1];
        let weights = outputs.map(|output| self.weight(output, at));
        let places = outputs.map(|output| output % sums.len());
        let Ok([first, second]) = sums.get_disjoint_mut(places) else {
            return;
        };
        let pixels = &row[4 * columns.start..4 * columns.end];
        // One channel at a time: the processor has too few registers for three.
        for (channel, (first, second)) in (0..3).zip(first.iter_mut().zip(second)) {
            let sums = first[columns.clone()]
                .iter_mut()
                .zip(&mut second[columns.clone()]);
            for (pixel, (first, second)) in pixels.chunks_exact(4).zip(sums) {
                let light = light_at(pixel, channel);
                *first += weights[0] * light;
                *second += weights[1] * light;
            }
        }
    }

    /// The weight of row `at` in an output row to which it belongs.
    #[inline(always)]
    fn weight(&self, output: usize, at: usize) -> f32 {
        let (start, weights) = self.down.window(output);
        weights[at - start]
    }

    /// Filters an output row across.
    #[inline(always)]
    fn finish(&self, output: usize, buffers: &mut ScaleBuffers, scaled: &mut RgbImage) {
        let ScaleBuffers {
            sums,
            line,
            across,
            levels,
            ..
        } = buffers;
        let sums = &sums[output % sums.len()];
        let width = self.mask.width() as usize;
        let row = output * width..(output + 1) * width;
        let mask = self.mask.as_raw().get(row.clone()).unwrap_or_default();
        let columns = hull(mask);
        let Some(last) = columns.clone().last() else {
            return;
        };
        let window = |x: usize| {
            let (start, weights) = self.across.window(x);
            (start..start + weights.len(), weights)
        };
        let needed = window(columns.start).0.start..window(last).0.end;
        side_by_side(sums, needed, line);
        for x in columns.clone() {
            if mask[x] == 0 {
                across[x] = [0.0; PLANES];
                continue;
            }
            let (window, weights) = window(x);
            let filtered = weighed_sum(weights, &line[window]);
            let gain = match self.gain {
                Some(gain) => gain[row.start + x],
                // Where nothing of the moved object is left, the pixel stays 0.
                None => 1.0 / filtered[PLANES - 1].max(1e-5),
            };
            across[x] = filtered.map(|light| gain * light);
        }
        // In loops of their own: the first of them becomes vector instructions, the second waits for the table only.
        let (across, levels) = (&across[columns.clone()], &mut levels[columns.clone()]);
        for (level, light) in levels
            .as_flattened_mut()
            .iter_mut()
            .zip(across.as_flattened())
        {
            *level = Srgb::level(*light);
        }
        let values = 3 * (row.start + columns.start)..3 * (row.start + columns.end);
        let values = scaled.get_mut(values).unwrap_or_default();
        for (pixel, levels) in values.as_chunks_mut::<3>().0.iter_mut().zip(levels) {
            for (value, level) in pixel.iter_mut().zip(levels) {
                *value = self.srgb.value(*level);
            }
        }
    }
}

impl ScaleBuffers {
    fn reset(&mut self, length: usize, ring: usize, outputs: usize) {
        self.line.resize(length, [0.0; PLANES]);
        self.across.resize(outputs, [0.0; PLANES]);
        self.levels.resize(outputs, [0; PLANES]);
        let all = self.sums.iter_mut().flatten().chain(&mut self.light);
        for plane in all.filter(|plane| plane.len() != length) {
            plane.clear();
            plane.resize(length, 0.0);
        }
        self.sums
            .resize_with(ring, || std::array::from_fn(|_| vec![0.0; length]));
    }
}

/// The light of these columns of a row.
#[inline(always)]
fn light_of(row: &[u8], columns: &Range<usize>, light: &mut [Vec<f32>; PLANES]) {
    let pixels = &row[4 * columns.start..4 * columns.end];
    // As in `add_light`.
    for (channel, plane) in (0..3).zip(light) {
        let plane = &mut plane[columns.clone()];
        for (pixel, light) in pixels.chunks_exact(4).zip(plane) {
            *light = light_at(pixel, channel);
        }
    }
}

/// The light of a pixel's channel.
#[inline(always)]
fn light_at(pixel: &[u8], channel: u32) -> f32 {
    let all = u32::from_le_bytes([pixel[0], pixel[1], pixel[2], pixel[3]]);
    linear((all >> (8 * channel)) & 255)
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

/// Puts these columns of planes side by side.
#[inline(always)]
fn side_by_side(planes: &[Vec<f32>; PLANES], columns: Range<usize>, line: &mut [[f32; PLANES]]) {
    let [red, green, blue, shares] = planes.each_ref().map(|plane| &plane[columns.clone()]);
    let colours = red.iter().zip(green).zip(blue).zip(shares);
    for (to, (((red, green), blue), share)) in line[columns].iter_mut().zip(colours) {
        *to = [*red, *green, *blue, *share];
    }
}

/// The sum of pixels times their weights, whose number is a multiple of four.
#[inline(always)]
fn weighed_sum(weights: &[f32], pixels: &[[f32; PLANES]]) -> [f32; PLANES] {
    // In one array, so that it becomes one vector.
    let mut lanes = [0.0; 4 * PLANES];
    let fours = weights
        .as_chunks::<4>()
        .0
        .iter()
        .zip(pixels.as_flattened().as_chunks::<{ 4 * PLANES }>().0);
    for (weights, pixels) in fours {
        for (at, (sum, value)) in lanes.iter_mut().zip(pixels).enumerate() {
            *sum += weights[at / PLANES] * value;
        }
    }
    let lane = |at: usize, plane: usize| lanes[PLANES * at + plane];
    std::array::from_fn(|plane| {
        (lane(0, plane) + lane(2, plane)) + (lane(1, plane) + lane(3, plane))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_runs_of_a_row_are_what_lies_under_the_mask_and_nothing_else() {
        for row in [
            &[][..],
            &[0, 0],
            &[255, 255, 255],
            &[0, 255, 0, 255, 128, 0],
            &[1, 0, 0, 7],
        ] {
            let runs = runs(row);
            let under = |at: usize| runs.iter().any(|run| run.contains(&at));
            assert!(
                row.iter().enumerate().all(|(at, &m)| under(at) == (m != 0)),
                "{row:?}"
            );
            // No two of them touch.
            assert!(
                runs.windows(2).all(|pair| pair[0].end < pair[1].start),
                "{row:?}"
            );
        }
    }
}
