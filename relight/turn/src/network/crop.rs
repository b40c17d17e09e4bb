//! A turn's curves on the square grid around the object that the network of turns is given, and back.

use rayon::prelude::*;
use relight_core::light::NormalEquations;

use crate::model::harmonics::COEFFICIENTS;
use crate::network::input::NetworkTurn;
use crate::observe::curves::TurnCurves;

/// Width and height of the grid. By convention: what the network was trained on.
const SIDE: usize = 128;
/// Part of the grid's side that the object takes. By convention: as of the objects that it was trained on.
const FILL: f32 = 0.9;
/// The weight of a pixel at the mask's edge relative to one inside. By hand: it shows some of the background.
const EDGE: f32 = 0.02;
/// Ridge on the harmonics, as a part of the mean of the diagonal. Numerical.
const RIDGE: f64 = 1e-6;

/// Width and height of the grid.
pub(crate) const GRID: usize = SIDE;

/// The curves of a turn on the grid.
pub(crate) struct Crop {
    /// The grid's upper left corner in the frame, pixels.
    corner: [f32; 2],
    /// A cell's side, pixels of the frame.
    step: f32,
    pixels: Vec<u32>,
    curves: Vec<[[f32; 3]; COEFFICIENTS]>,
}

impl Crop {
    pub(crate) fn new(curves: &TurnCurves) -> Self {
        let (corner, step) = place_of(curves);
        let frame = CoveredPixels::new(curves);
        let cells: Vec<(u32, [[f32; 3]; COEFFICIENTS])> = (0..(GRID * GRID) as u32)
            .into_par_iter()
            .filter_map(|cell| {
                let members = frame.of_cell(cell, corner, step);
                Some((cell, frame.coefficients(&members?)?))
            })
            .collect();
        let (pixels, curves) = cells.into_iter().unzip();
        Self {
            corner,
            step,
            pixels,
            curves,
        }
    }

    /// The turn as the network is given it.
    pub(crate) fn turn(&self, elevation: f32) -> NetworkTurn<'_> {
        NetworkTurn {
            side: GRID,
            pixels: &self.pixels,
            curves: &self.curves,
            elevation,
        }
    }

    /// The left-right mirror image, whose table turns the other way.
    pub(crate) fn mirrored(&self) -> Self {
        let side = GRID as u32;
        let mut cells: Vec<(u32, [[f32; 3]; COEFFICIENTS])> = self
            .pixels
            .iter()
            .zip(&self.curves)
            .map(|(&pixel, curve)| {
                let mirrored = pixel / side * side + (side - 1 - pixel % side);
                (mirrored, mirrored_curve(curve))
            })
            .collect();
        cells.sort_unstable_by_key(|(pixel, _)| *pixel);
        let (pixels, curves) = cells.into_iter().unzip();
        Self {
            pixels,
            curves,
            ..*self
        }
    }

    /// Values of the grid's cells at a pixel of the frame, between the four cells around it.
    pub(crate) fn at<const N: usize>(
        &self,
        cells: &[Option<[f32; N]>],
        x: usize,
        y: usize,
    ) -> Option<[f32; N]> {
        let place = |pixel: usize, corner: f32| (pixel as f32 + 0.5 - corner) / self.step - 0.5;
        let (u, v) = (place(x, self.corner[0]), place(y, self.corner[1]));
        let (mut sum, mut weights) = ([0.0; N], 0.0);
        for (row, wy) in around(v) {
            for (column, wx) in around(u) {
                let Some(value) = cells[row * GRID + column] else {
                    continue;
                };
                // Cells of no weight count where there are no others.
                let weight = wx * wy + 1e-6;
                weights += weight;
                sum.iter_mut()
                    .zip(value)
                    .for_each(|(sum, value)| *sum += weight * value);
            }
        }
        (weights > 0.0).then(|| sum.map(|sum| sum / weights))
    }

    /// The cells of the grid that the object covers, ascending.
    pub(crate) fn pixels(&self) -> &[u32] {
        &self.pixels
    }
}

/// The mean light of every pixel, as the network is given it on the grid.
pub(crate) fn mean_light(curves: &TurnCurves) -> Vec<[f32; 3]> {
    let frame = CoveredPixels::new(curves);
    let parts = frame.is_seen.iter().filter(|&&seen| seen).count().max(1) as f32;
    (0..curves.pixels())
        .map(|pixel| {
            let mut sum = [0.0; 3];
            for part in (0..curves.parts()).filter(|&part| frame.is_seen[part]) {
                let light = frame.light(pixel, part);
                sum.iter_mut()
                    .zip(light)
                    .for_each(|(sum, light)| *sum += light);
            }
            sum.map(|sum| sum / parts)
        })
        .collect()
}

/// The cells on both sides of a place and how much each counts.
fn around(place: f32) -> [(usize, f32); 2] {
    let last = (GRID - 1) as f32;
    let below = place.floor();
    let part = place - below;
    [(below, 1.0 - part), (below + 1.0, part)]
        .map(|(cell, weight)| (cell.clamp(0.0, last) as usize, weight))
}

/// The curve in the mirror image: q becomes -conj(q).
fn mirrored_curve(curve: &[[f32; 3]; COEFFICIENTS]) -> [[f32; 3]; COEFFICIENTS] {
    let mut mirrored = *curve;
    for m in 1..=COEFFICIENTS / 2 {
        let sign = if m % 2 == 1 { -1.0 } else { 1.0 };
        mirrored[2 * m - 1] = mirrored[2 * m - 1].map(|value| sign * value);
        mirrored[2 * m] = mirrored[2 * m].map(|value| -sign * value);
    }
    mirrored
}

/// Corner and cell of a grid in whose middle the object stands.
fn place_of(curves: &TurnCurves) -> ([f32; 2], f32) {
    let width = curves.extent().width;
    let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
    for &place in curves.places() {
        for (axis, value) in [place % width, place / width].into_iter().enumerate() {
            low[axis] = low[axis].min(value);
            high[axis] = high[axis].max(value + 1);
        }
    }
    let extents = [0, 1].map(|axis| (high[axis] - low[axis]) as f32);
    let side = extents[0].max(extents[1]) / FILL;
    let middles = [0, 1].map(|axis| (high[axis] + low[axis]) as f32 / 2.0);
    (
        middles.map(|middle| middle - side / 2.0),
        side / GRID as f32,
    )
}

/// The pixels under the mask by their place.
struct CoveredPixels<'a> {
    curves: &'a TurnCurves,
    /// The number of each of the frame's pixels among those under the mask.
    numbers: Vec<Option<usize>>,
    /// Parts of the turn that count for any pixel.
    is_seen: Vec<bool>,
}

impl<'a> CoveredPixels<'a> {
    fn new(curves: &'a TurnCurves) -> Self {
        let mut numbers = vec![None; curves.extent().pixels()];
        for (number, &place) in curves.places().iter().enumerate() {
            numbers[place] = Some(number);
        }
        let mut is_seen = vec![false; curves.parts()];
        for pixel in 0..curves.pixels() {
            let weights = curves.weights(pixel).iter();
            for (seen, weight) in is_seen.iter_mut().zip(weights) {
                *seen |= weight.iter().any(|&weight| weight > 0.0);
            }
        }
        Self {
            curves,
            numbers,
            is_seen,
        }
    }

    fn number(&self, x: isize, y: isize) -> Option<usize> {
        let extent = self.curves.extent();
        let (x, y) = (usize::try_from(x).ok()?, usize::try_from(y).ok()?);
        (x < extent.width && y < extent.height).then(|| self.numbers[y * extent.width + x])?
    }

    /// The pixels of a cell and what each counts; `None` if fewer than half of them are under the mask.
    fn of_cell(&self, cell: u32, corner: [f32; 2], step: f32) -> Option<Vec<(usize, f32)>> {
        let at = [cell as usize % GRID, cell as usize / GRID];
        let range = |axis: usize| {
            let begin = (corner[axis] + at[axis] as f32 * step).round() as isize;
            let end = (corner[axis] + (at[axis] + 1) as f32 * step).round() as isize;
            if end > begin {
                return begin..end;
            }
            let middle = (corner[axis] + (at[axis] as f32 + 0.5) * step).floor() as isize;
            middle..middle + 1
        };
        let (columns, rows) = (range(0), range(1));
        let all = columns.len() * rows.len();
        let mut members = Vec::with_capacity(all);
        for y in rows {
            for x in columns.clone() {
                let Some(number) = self.number(x, y) else {
                    continue;
                };
                let is_inside = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)]
                    .into_iter()
                    .all(|(x, y)| self.number(x, y).is_some());
                members.push((number, if is_inside { 1.0 } else { EDGE }));
            }
        }
        (2 * members.len() >= all && !members.is_empty()).then_some(members)
    }

    /// The light of a pixel in a part of the turn. What is clipped counts as white: a camera that cuts light off is what the
    /// network has seen.
    fn light(&self, pixel: usize, part: usize) -> [f32; 3] {
        let white = self.curves.clipped_value() as f32;
        let (values, seen) = (
            self.curves.values(pixel)[part],
            self.curves.weights(pixel)[part],
        );
        [0, 1, 2].map(|c| if seen[c] > 0.0 { values[c] } else { white })
    }

    /// The Fourier coefficients of the mean curve of pixels.
    fn coefficients(&self, members: &[(usize, f32)]) -> Option<[[f32; 3]; COEFFICIENTS]> {
        let total: f32 = members.iter().map(|(_, weight)| weight).sum();
        let mut equations = NormalEquations::new(COEFFICIENTS);
        let parts = self.curves.harmonics().iter().enumerate();
        for (part, harmonics) in parts.filter(|(part, _)| self.is_seen[*part]) {
            let mut mean = [0.0; 3];
            for &(pixel, weight) in members {
                for (mean, light) in mean.iter_mut().zip(self.light(pixel, part)) {
                    *mean += f64::from(light * weight / total);
                }
            }
            equations.add(harmonics, mean);
        }
        equations.add_ridge(1, RIDGE);
        let solved = equations.solve()?;
        let mut coefficients = [[0.0; 3]; COEFFICIENTS];
        for (to, from) in coefficients.iter_mut().zip(solved) {
            *to = from.map(|value| value as f32);
        }
        Some(coefficients)
    }
}
