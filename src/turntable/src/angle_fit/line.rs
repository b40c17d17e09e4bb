//! Robust fit of a straight line: some of the points may be wrong.
//!
//! The initial estimate uses medians, on which up to a quarter of wrong points have little effect
//! (slopes of pairs half the data apart, after Theil 1950 and Sen 1968). Three rounds of least squares
//! over the points near the line refine it.

use relit_data::statistics::upper_median;

/// Rounds of rejecting outliers and fitting again.
const ROUNDS: usize = 3;
/// A point is an outlier beyond so many standard deviations.
const SIGMAS: f64 = 4.0;
/// Ratio of a normal distribution's standard deviation to its median absolute deviation.
const SIGMA_OF_MAD: f64 = 1.4826;

/// A straight line, relative to a point near the data so that large coordinates lose no precision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    pub(super) x0: f64,
    pub(super) y0: f64,
    pub(super) slope: f64,
}

impl Line {
    pub(super) fn at(&self, x: f64) -> f64 {
        self.y0 + (x - self.x0) * self.slope
    }

    pub(super) fn inverse(&self, y: f64) -> Option<f64> {
        let x = self.x0 + (y - self.y0) / self.slope;
        x.is_finite().then_some(x)
    }

    /// The line over z, where this line maps x to y and `other` maps x to z.
    pub(super) fn over(&self, other: &Line) -> Line {
        Line {
            x0: other.at(self.x0),
            y0: self.y0,
            slope: self.slope / other.slope,
        }
    }
}

/// A fitted line and the points used.
#[derive(Debug)]
pub(super) struct Fit {
    pub(super) line: Line,
    /// For each point, whether it is not an outlier.
    pub(super) kept: Vec<bool>,
}

/// Fits a line to `points`, which are sorted by x and mostly right. Points with a residual
/// below `floor` are never outliers.
pub(super) fn robust(points: &[(f64, f64)], floor: f64) -> Fit {
    let mut line = guess(points);
    let mut kept = vec![true; points.len()];
    for _ in 0..ROUNDS {
        let off = |&(x, y): &(f64, f64)| (y - line.at(x)).abs();
        let offs: Vec<f64> = points.iter().map(off).collect();
        let median = upper_median(offs.iter().copied()).unwrap_or_default();
        let limit = (median * SIGMA_OF_MAD * SIGMAS).max(floor);
        kept = offs.iter().map(|off| *off <= limit).collect();
        let near = points.iter().zip(&kept).filter(|(_, kept)| **kept);
        line = least_squares(near.map(|(point, _)| *point)).unwrap_or(line);
    }
    Fit { line, kept }
}

/// The line of a given slope through the middle of `points`.
pub(super) fn through(points: &[(f64, f64)], slope: f64) -> Line {
    let x0 = upper_median(points.iter().map(|point| point.0)).unwrap_or_default();
    let levels = points.iter().map(|(x, y)| y - (x - x0) * slope);
    let y0 = upper_median(levels).unwrap_or_default();
    Line { x0, y0, slope }
}

fn guess(points: &[(f64, f64)]) -> Line {
    let half = points.len() / 2;
    let far = points.iter().skip(half);
    let slopes = points
        .iter()
        .zip(far)
        .map(|((x, y), (xx, yy))| (yy - y) / (xx - x));
    let slope = upper_median(slopes.filter(|slope| slope.is_finite()));
    through(points, slope.unwrap_or_default())
}

fn least_squares(points: impl Iterator<Item = (f64, f64)> + Clone) -> Option<Line> {
    let count = points.clone().count() as f64;
    let (sum_x, sum_y) = points
        .clone()
        .fold((0.0, 0.0), |(a, b), (x, y)| (a + x, b + y));
    let (x0, y0) = (sum_x / count, sum_y / count);
    let sums = points.fold((0.0, 0.0), |(xx, xy), (x, y)| {
        let (dx, dy) = (x - x0, y - y0);
        (xx + dx * dx, xy + dx * dy)
    });
    let slope = sums.1 / sums.0;
    slope.is_finite().then_some(Line { x0, y0, slope })
}
