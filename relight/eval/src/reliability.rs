//! Whether expected errors are what they say: pixels by their expected error beside the error that they have.

use std::path::Path;

use relight_core::files::write_png;
use relight_core::image::{Depth, Extent, Planes};
use serde::Serialize;

use super::EvalError;

/// Width of a bin of expected errors, degrees.
const BIN_DEG: f64 = 5.0;
/// Bins; the last one has all that is expected beyond.
const BINS: usize = 9;
/// Pixels of a picture for one degree.
const PIXELS_A_DEGREE: f64 = 6.0;
/// Pixels around and between the diagrams.
const MARGIN: usize = 16;
/// Degrees between the lines of the grid.
const GRID_DEG: usize = 10;
const PAPER: [f32; 3] = [1.0; 3];
const GRID: [f32; 3] = [0.85; 3];
const DIAGONAL: [f32; 3] = [0.35; 3];
const BAR: [f32; 3] = [0.27, 0.51, 0.71];

/// Pixels whose errors are expected to be alike.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct ReliabilityBin {
    /// How many.
    pub pixels: usize,
    /// The sum of the errors that are expected of them, degrees.
    pub expected_deg: f64,
    /// The sum of the errors that they have, degrees.
    pub error_deg: f64,
}

impl ReliabilityBin {
    fn means(&self) -> Option<[f64; 2]> {
        let count = self.pixels as f64;
        (self.pixels > 0).then(|| [self.expected_deg / count, self.error_deg / count])
    }
}

/// Bins of 5 degrees, of pixels given by their expected error and their error, degrees.
pub(crate) fn reliability(pixels: impl Iterator<Item = (f64, f64)>) -> Vec<ReliabilityBin> {
    let mut bins = vec![ReliabilityBin::default(); BINS];
    for (expected, error) in pixels {
        let bin = &mut bins[((expected.max(0.0) / BIN_DEG) as usize).min(BINS - 1)];
        bin.pixels += 1;
        bin.expected_deg += expected;
        bin.error_deg += error;
    }
    bins
}

/// The sums of several lists of bins.
pub(crate) fn summed<'a>(lists: impl Iterator<Item = &'a [ReliabilityBin]>) -> Vec<ReliabilityBin> {
    let mut sums = vec![ReliabilityBin::default(); BINS];
    for list in lists {
        for (sum, bin) in sums.iter_mut().zip(list) {
            sum.pixels += bin.pixels;
            sum.expected_deg += bin.expected_deg;
            sum.error_deg += bin.error_deg;
        }
    }
    sums
}

/// Draws reliability diagrams side by side: expected errors to the right, errors upwards, both up to 45 degrees with a
/// line every 10; where a bar ends on the diagonal, errors are what they are expected to be. Bars are paler, the fewer
/// pixels they stand for.
///
/// # Errors
/// Where the file cannot be written.
pub(crate) fn write_diagrams(
    path: &Path,
    diagrams: &[Vec<ReliabilityBin>],
) -> Result<(), EvalError> {
    let side = (BINS as f64 * BIN_DEG * PIXELS_A_DEGREE) as usize;
    let width = MARGIN + diagrams.len() * (side + MARGIN);
    let mut image = Planes::<3>::filled(Extent::new(width, side + 2 * MARGIN), PAPER);
    for (number, bins) in diagrams.iter().enumerate() {
        draw(&mut image, MARGIN + number * (side + MARGIN), side, bins);
    }
    Ok(write_png(path, &image, Depth::Eight)?)
}

fn draw(image: &mut Planes<3>, left: usize, side: usize, bins: &[ReliabilityBin]) {
    let most = bins.iter().map(|bin| bin.pixels).max().unwrap_or(0).max(1);
    let step = GRID_DEG * PIXELS_A_DEGREE as usize;
    let width = side / BINS;
    for x in 0..side {
        let bin = bins.get(x / width).copied().unwrap_or_default();
        let height = bin
            .means()
            .map_or(0, |[_, error]| (error * PIXELS_A_DEGREE) as usize);
        let part = (bin.pixels as f32 / most as f32).sqrt();
        let bar = [0, 1, 2].map(|c| PAPER[c] + part * (BAR[c] - PAPER[c]));
        let is_gap = x % width < 2;
        for y in 0..side {
            let is_diagonal = x.abs_diff(y) < 2;
            let is_grid = x % step == 0 || y % step == 0;
            let colour = if is_diagonal {
                DIAGONAL
            } else if y < height && !is_gap {
                bar
            } else if is_grid {
                GRID
            } else {
                continue;
            };
            image.set_pixel(left + x, MARGIN + side - 1 - y, colour);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_counted_by_what_is_expected_of_them() {
        let bins = reliability([(2.0, 3.0), (4.0, 1.0), (12.0, 30.0), (80.0, 50.0)].into_iter());
        assert_eq!(bins[0].means(), Some([3.0, 2.0]));
        assert_eq!(bins[1].means(), None);
        assert_eq!(bins[2].means(), Some([12.0, 30.0]));
        assert_eq!(bins[BINS - 1].pixels, 1);
        let twice = summed([bins.as_slice(), bins.as_slice()].into_iter());
        assert_eq!(twice[0].pixels, 4);
        assert_eq!(twice[0].means(), bins[0].means());
    }

    #[test]
    fn bars_of_a_diagram_are_as_high_as_the_errors() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("reliability.png");
        let bins = reliability([(7.0, 20.0)].into_iter());
        write_diagrams(&path, &[bins.clone(), bins]).unwrap();
        let drawn = image::open(&path).unwrap().to_rgb8();
        let side = BINS as u32 * 30;
        assert_eq!(drawn.dimensions(), (16 + 2 * (side + 16), side + 32));
        // In the second bin, below and above 20 degrees, of both diagrams.
        for left in [16, 16 + side + 16] {
            let at = |degrees: u32| drawn.get_pixel(left + 47, 16 + side - 1 - 6 * degrees).0;
            assert_eq!(at(17)[0], 69);
            assert_eq!(at(23)[0], 255);
        }
    }
}
