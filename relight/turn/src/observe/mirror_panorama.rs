//! The panorama that a chrome ball shows.

use std::f64::consts::{FRAC_1_PI, PI, TAU};

use relight_core::image::Planes;
use relight_core::light::{Direction, Order, ShLight, basis};

use crate::error::TurnError;
use crate::model::directions::reflected;
use crate::model::frame::TableFrame;
use crate::observe::curves::TurnCurves;

/// Rows of the panorama, from the table's axis upwards to downwards. By hand: about 6 degrees, finer than order 6
/// shows.
const ROWS: usize = 32;
/// Columns of the panorama. Derived: twice the rows, so that cells are square at the equator.
const COLUMNS: usize = 64;

/// The panorama that a chrome ball shows of the environment light while it turns, in the table's frame at its angle 0.
#[derive(Debug)]
pub(crate) struct MirrorPanorama {
    frame: TableFrame,
    sums: Vec<[f64; 3]>,
    counts: Vec<f64>,
}

impl MirrorPanorama {
    pub(crate) fn new(frame: TableFrame) -> Self {
        Self {
            frame,
            sums: vec![[0.0; 3]; ROWS * COLUMNS],
            counts: vec![0.0; ROWS * COLUMNS],
        }
    }

    /// The picture of a ball with these normals. Clipped pixels count as white.
    pub(crate) fn from_curves(curves: &TurnCurves, normals: &Planes<3>, frame: TableFrame) -> Self {
        let white = curves.clipped_value();
        let mut panorama = Self::new(frame);
        for (pixel, normal) in curves.pixels_of(normals).enumerate() {
            let parts = curves.values(pixel).iter().zip(curves.weights(pixel));
            for ((value, weight), &angle) in parts.zip(curves.angles()) {
                let light = [0, 1, 2].map(|c| {
                    if weight[c] > 0.0 {
                        f64::from(value[c])
                    } else {
                        white
                    }
                });
                panorama.add(angle, normal, light);
            }
        }
        panorama
    }

    /// Adds what a normal of the ball shows at an angle of the table, radians.
    pub(crate) fn add(&mut self, angle: f64, normal: [f64; 3], light: [f64; 3]) {
        let cell = self.cell(angle, normal);
        for (sum, light) in self.sums[cell].iter_mut().zip(light) {
            *sum += light;
        }
        self.counts[cell] += 1.0;
    }

    /// What the same direction showed in the mean; `None` if it was never added.
    pub(crate) fn seen(&self, angle: f64, normal: [f64; 3]) -> Option<[f64; 3]> {
        let cell = self.cell(angle, normal);
        mean(&self.sums[cell..=cell], &self.counts[cell..=cell])
    }

    /// The mean of all that was added.
    pub(crate) fn all(&self) -> Option<[f64; 3]> {
        mean(&self.sums, &self.counts)
    }

    /// Where the direction is that a normal of the ball shows.
    fn cell(&self, angle: f64, normal: [f64; 3]) -> usize {
        let [x, y, z] = self.frame.to_table(reflected(normal));
        let azimuth = y.atan2(x) + angle;
        let column = (azimuth.rem_euclid(TAU) / TAU * COLUMNS as f64) as usize % COLUMNS;
        let row = ((z.clamp(-1.0, 1.0).acos() / PI * ROWS as f64) as usize).min(ROWS - 1);
        row * COLUMNS + column
    }

    /// Its coefficients; directions that it never shows are as bright as their row, or as all.
    pub(crate) fn light(&self) -> Result<ShLight, TurnError> {
        let all = self.all().ok_or(TurnError::NoLight)?;
        let order = Order::GLOSS;
        let mut light = ShLight::even(order, [0.0; 3]);
        for row in 0..ROWS {
            let cells = row * COLUMNS..(row + 1) * COLUMNS;
            let of_row = mean(&self.sums[cells.clone()], &self.counts[cells]).unwrap_or(all);
            let polar = PI * (row as f64 + 0.5) / ROWS as f64;
            let edges = [row, row + 1].map(|edge| (PI * edge as f64 / ROWS as f64).cos());
            let area = (edges[0] - edges[1]) * TAU / COLUMNS as f64;
            for column in 0..COLUMNS {
                let cell = row * COLUMNS + column;
                let shown = mean(&self.sums[cell..=cell], &self.counts[cell..=cell]);
                let azimuth = TAU * (column as f64 + 0.5) / COLUMNS as f64;
                let (sin, cos) = azimuth.sin_cos();
                let to = Direction::new(polar.sin() * cos, polar.sin() * sin, polar.cos());
                let Some(to) = to else { continue };
                let values = basis(order, to);
                for (coefficient, value) in light.coefficients_mut().iter_mut().zip(values) {
                    for (sum, shown) in coefficient.iter_mut().zip(shown.unwrap_or(of_row)) {
                        *sum += FRAC_1_PI * area * value * shown;
                    }
                }
            }
        }
        Ok(light)
    }
}

/// The mean of all cells that were seen.
fn mean(sums: &[[f64; 3]], counts: &[f64]) -> Option<[f64; 3]> {
    let count: f64 = counts.iter().sum();
    let sum = |channel: usize| sums.iter().map(|sum| sum[channel]).sum::<f64>();
    (count > 0.0).then(|| [0, 1, 2].map(|channel| sum(channel) / count))
}
