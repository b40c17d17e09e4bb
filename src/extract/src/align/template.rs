//! What stays the same on an object while the light moves: the median of its gradients over a turn.
//!
//! The median of log gradients over many lights is the gradient of the paint (Weiss, "Deriving intrinsic
//! images from image sequences", 2001). How far single frames are from it says how much a pixel can be
//! trusted: where highlights and shadows pass, little.

use std::ops::Range;

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use super::median::{LANES, Medians};
use super::structure::{Plane, add_scaled, cubic};

/// Pixels of a template; those that say most about a shift are kept.
const MAX_PIXELS: usize = 4_000;
/// Pixels whose errors are taken for one.
const PIECE: usize = 128;
/// Side of the squares in whose order the pixels stand, so that neighbours are near each other.
pub(super) const TILE: u32 = 24;
/// Rows of a template that a thread makes at a time.
const BAND: usize = 16;
/// Deviation of the gradients by noise.
const NOISE: f32 = 0.01;

/// A pixel of a template.
#[derive(Debug, Clone, Copy)]
pub(super) struct TemplatePixel {
    pub(super) x: u32,
    pub(super) y: u32,
    /// The gradient.
    pub(super) gradient: [f32; 2],
    /// The gradient's change to the right and, from there, downwards: xx, xy, yy.
    pub(super) change: [f32; 3],
    /// 1 / the square of its usual deviation.
    pub(super) trust: f32,
    /// How much it counts: it falls faster than the trust, because what deviates often is light.
    pub(super) weight: f32,
}

/// The object's lasting structure.
#[derive(Debug, Default)]
pub(super) struct Template {
    /// Tile by tile.
    pub(super) pixels: Vec<TemplatePixel>,
    /// About as many that follow each other lie together, and their errors are taken for one: light that passes pulls at all
    /// of them.
    pub(super) piece: usize,
}

/// Median and deviation of the gradients of one row.
struct TemplateRow {
    gradients: Vec<[f32; 2]>,
    deviations: Vec<f32>,
}

impl Template {
    /// The template of pictures whose object lies at these shifts, under `inner` (row by row).
    pub(super) fn from_planes(planes: &[Plane], shifts: &[[f64; 2]], inner: &[bool]) -> Self {
        let Some((width, height)) = planes.first().map(|plane| (plane.width, plane.height)) else {
            return Self::default();
        };
        if width < 3 || height < 3 {
            return Self::default();
        }
        let bands = (0..height).step_by(BAND).collect::<Vec<_>>();
        let bands: Vec<Vec<TemplateRow>> = bands
            .into_par_iter()
            .map(|from| band(planes, shifts, inner, from..(from + BAND).min(height)))
            .collect();
        let rows: Vec<TemplateRow> = bands.into_iter().flatten().collect();
        let mut pixels = Vec::new();
        for y in 1..height - 1 {
            for x in (1..width - 1).filter(|x| inner.get(y * width + x) == Some(&true)) {
                pixels.push(pixel(&rows, x, y));
            }
        }
        keep_most_telling(&mut pixels, MAX_PIXELS);
        Self {
            pixels,
            piece: PIECE,
        }
    }
}

fn pixel(rows: &[TemplateRow], x: usize, y: usize) -> TemplatePixel {
    let at = |x: usize, y: usize| rows[y].gradients[x];
    let (left, right) = (at(x - 1, y), at(x + 1, y));
    let (above, below) = (at(x, y - 1), at(x, y + 1));
    let across = 0.25 * (right[1] - left[1] + below[0] - above[0]);
    let deviation = rows[y].deviations[x];
    let trust = 1.0 / (deviation * deviation + NOISE * NOISE);
    TemplatePixel {
        x: x as u32,
        y: y as u32,
        gradient: at(x, y),
        change: [
            0.5 * (right[0] - left[0]),
            across,
            0.5 * (below[1] - above[1]),
        ],
        trust,
        weight: trust * trust.sqrt().sqrt(),
    }
}

/// What a pixel says about a shift.
pub(super) fn information(pixel: &TemplatePixel) -> f32 {
    let [xx, xy, yy] = pixel.change;
    pixel.weight * (xx * xx + 2.0 * xy * xy + yy * yy)
}

/// Keeps at most so many, in an order in which neighbours are near each other.
pub(super) fn keep_most_telling(pixels: &mut Vec<TemplatePixel>, most: usize) {
    if pixels.len() > most {
        pixels.select_nth_unstable_by(most, |a, b| {
            information(b)
                .total_cmp(&information(a))
                .then((a.y, a.x).cmp(&(b.y, b.x)))
        });
        pixels.truncate(most);
    }
    let tile = |pixel: &TemplatePixel| (pixel.y / TILE, pixel.x / TILE, pixel.y, pixel.x);
    pixels.sort_unstable_by_key(tile);
}

/// Rows that are made together: of those above and below, which both need, few are made twice.
fn band(
    planes: &[Plane],
    shifts: &[[f64; 2]],
    inner: &[bool],
    rows: Range<usize>,
) -> Vec<TemplateRow> {
    let width = planes.first().map_or(0, |plane| plane.width);
    let mut found: Vec<TemplateRow> = rows
        .clone()
        .map(|_| TemplateRow {
            gradients: vec![[0.0; 2]; width],
            deviations: vec![0.0; width],
        })
        .collect();
    let needed: Vec<Vec<usize>> = rows.clone().map(|y| needed(inner, width, y)).collect();
    if needed.iter().all(Vec::is_empty) {
        return found;
    }
    let first = rows.start as isize - 1;
    let moved: Vec<Vec<Vec<f32>>> = planes
        .iter()
        .zip(shifts)
        .map(|(plane, &shift)| {
            let around = first..rows.end as isize + 1;
            around.map(|y| moved_row(plane, shift, y)).collect()
        })
        .collect();
    let mut medians = Medians::new(planes.len());
    let [mut across, mut down] = [0, 1].map(|_| vec![[0.0; LANES]; planes.len()]);
    for (at, (row, needed)) in found.iter_mut().zip(needed).enumerate() {
        for columns in needed.chunks(LANES) {
            for ((rows, across), down) in moved.iter().zip(&mut across).zip(&mut down) {
                let [above, here, below] = [&rows[at], &rows[at + 1], &rows[at + 2]];
                for ((&x, across), down) in columns.iter().zip(across).zip(down) {
                    *across = 0.5 * (here[x + 1] - here[x - 1]);
                    *down = 0.5 * (below[x] - above[x]);
                }
            }
            let (mid_x, mid_y) = (medians.of(&across), medians.of(&down));
            for (across, down) in across.iter_mut().zip(&down) {
                for (lane, (a, d)) in across.iter_mut().zip(down).enumerate() {
                    let (x, y) = (*a - mid_x[lane], d - mid_y[lane]);
                    *a = (x * x + y * y).sqrt();
                }
            }
            let deviations = medians.of(&across);
            for (lane, &x) in columns.iter().enumerate() {
                row.gradients[x] = [mid_x[lane], mid_y[lane]];
                row.deviations[x] = deviations[lane];
            }
        }
    }
    found
}

/// The columns of row `y` whose gradients are needed: a pixel's change needs those of its four neighbours.
fn needed(inner: &[bool], width: usize, y: usize) -> Vec<usize> {
    let wanted = |y: usize, x: usize| inner.get(y * width + x) == Some(&true);
    (1..width - 1)
        .filter(|&x| {
            wanted(y, x - 1)
                || wanted(y, x)
                || wanted(y, x + 1)
                || wanted(y + 1, x)
                || y.checked_sub(1).is_some_and(|above| wanted(above, x))
        })
        .collect()
}

/// Row `y` of a picture that is moved back by its shift.
fn moved_row(plane: &Plane, [dx, dy]: [f64; 2], y: isize) -> Vec<f32> {
    let (whole_x, whole_y) = (dx.floor(), dy.floor());
    let (weights_x, weights_y) = (cubic((dx - whole_x) as f32), cubic((dy - whole_y) as f32));
    let mut line = vec![0.0; plane.width];
    for (weight, step) in weights_y.into_iter().zip(-1..) {
        add_scaled(&mut line, plane.row(y + whole_y as isize + step), weight);
    }
    let mut moved = vec![0.0; plane.width];
    let last = plane.width as isize - 1;
    for (weight, step) in weights_x.into_iter().zip(-1..) {
        let by = whole_x as isize + step;
        // Columns whose values lie in the picture; beyond, its edge is repeated.
        let from = (-by).clamp(0, last + 1) as usize;
        let to = (last + 1 - by).clamp(from as isize, last + 1) as usize;
        let source = from.saturating_add_signed(by).min(plane.width);
        add_scaled(&mut moved[from..to], &line[source..], weight);
        let (first, last) = (line[0], line[plane.width - 1]);
        moved[..from]
            .iter_mut()
            .for_each(|to| *to += weight * first);
        moved[to..].iter_mut().for_each(|to| *to += weight * last);
    }
    moved
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moved_row_repeats_the_edge_on_both_sides() {
        let values: Vec<f32> = (0..7).map(|x| (x * x) as f32).collect();
        let plane = Plane {
            width: 7,
            height: 1,
            values: values.clone(),
        };
        for dx in [-30.0, -3.0, 0.0, 2.0, 6.0, 9.0] {
            let moved = moved_row(&plane, [dx, 0.0], 0);
            let wanted = (0..7).map(|x| values[(x + dx as i32).clamp(0, 6) as usize]);
            assert_eq!(moved, wanted.collect::<Vec<f32>>(), "{dx}");
        }
    }
}
