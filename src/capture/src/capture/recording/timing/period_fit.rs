//! A camera's exposure period and phase, found from time stamps alone.
//!
//! For a period `p`, the stamps are put on a circle of circumference `p`. For the true period they
//! gather on one side of it, even where each is off by up to 40 % of the period; for any other they
//! spread all around. The length of their mean vector is a periodogram (M. S. Bartlett,
//! *Periodogram analysis and continuous spectra*, Biometrika 37, 1950).

use super::line::Line;

/// Largest relative difference between the true period and the expected one.
const RANGE: f64 = 0.025;
/// Cycles of drift over all stamps between one period tried and the next.
const STEP_CYCLES: f64 = 0.25;
/// Most periods tried.
const MAX_STEPS: f64 = 4000.0;
/// Length of the mean vector from which the fit is accepted. Stamps off by up to 40 % either way
/// give sin(0.8 pi) / (0.8 pi) = 0.234, and random ones rarely more than this.
const CERTAIN: f64 = 0.15;
/// Length from which the fit is accepted if also no stamp lies midway between two exposures.
const POSSIBLE: f64 = 0.08;
/// Distance from the nearest exposure from which a stamp lies midway, in periods.
const MIDWAY: f64 = 0.46;
/// Most rounds of numbering the stamps and fitting the line again.
const ROUNDS: usize = 12;

/// Period and phase, and the exposure number that they give each stamp.
pub(super) struct PeriodFit {
    pub(super) line: Line,
    pub(super) numbers: Vec<i64>,
}

impl PeriodFit {
    /// Fits a period near `expected`; `None` if the stamps are too irregular.
    pub(super) fn find(times: &[f64], expected: f64) -> Option<Self> {
        let (frequency, vector) = strongest(times, 1.0 / expected);
        let length = vector.0.hypot(vector.1) / times.len() as f64;
        let period = 1.0 / frequency;
        let start = vector.1.atan2(vector.0) / std::f64::consts::TAU * period;
        let fit = Self::refined(times, Line { start, period });
        let accepted = length >= CERTAIN || (length >= POSSIBLE && fit.none_midway(times));
        accepted.then_some(fit)
    }

    /// For too few stamps to find a period from: the nominal one, from the first stamp on.
    pub(super) fn from_few(times: &[f64], nominal: f64) -> Self {
        let start = times.first().copied().unwrap_or(0.0);
        let line = Line {
            start,
            period: nominal,
        };
        let numbers = times.iter().map(|&time| line.nearest(time)).collect();
        Self { line, numbers }
    }

    /// A tenth of random stamps would lie midway.
    fn none_midway(&self, times: &[f64]) -> bool {
        let mut pairs = self.numbers.iter().zip(times);
        pairs.all(|(&number, &time)| self.line.off(number, time).abs() < MIDWAY)
    }

    /// Numbers the stamps by the line and fits the line to the numbers, until nothing changes.
    fn refined(times: &[f64], mut line: Line) -> Self {
        let number = |line: Line| -> Vec<i64> { times.iter().map(|&t| line.nearest(t)).collect() };
        let mut numbers = number(line);
        for _ in 0..ROUNDS {
            let Some(better) = Line::through(&numbers, times) else {
                break;
            };
            line = better;
            let again = number(line);
            if again == numbers {
                break;
            }
            numbers = again;
        }
        Self { line, numbers }
    }
}

/// The frequency near `expected` at which the stamps gather best, and the sum of their vectors.
fn strongest(times: &[f64], expected: f64) -> (f64, (f64, f64)) {
    let span = times.iter().fold(0.0, |most: f64, &time| most.max(time));
    let cycles = span * expected * 2.0 * RANGE;
    let steps = (cycles / STEP_CYCLES).clamp(8.0, MAX_STEPS).round();
    let lowest = expected * (1.0 - RANGE);
    let step = expected * 2.0 * RANGE / steps;
    // Each stamp's vector turns by the same angle from one frequency to the next.
    let mut vectors: Vec<[f64; 4]> = times
        .iter()
        .map(|&time| {
            let (sin, cos) = (std::f64::consts::TAU * lowest * time).sin_cos();
            let (sin_step, cos_step) = (std::f64::consts::TAU * step * time).sin_cos();
            [cos, sin, cos_step, sin_step]
        })
        .collect();
    let mut best = (lowest, (0.0, 0.0), -1.0);
    for at in 0..=steps as u32 {
        let (mut x, mut y) = (0.0, 0.0);
        for vector in &mut vectors {
            let [cos, sin, cos_step, sin_step] = *vector;
            x += cos;
            y += sin;
            vector[0] = cos * cos_step - sin * sin_step;
            vector[1] = sin * cos_step + cos * sin_step;
        }
        let square = x * x + y * y;
        if square > best.2 {
            best = (lowest + step * f64::from(at), (x, y), square);
        }
    }
    (best.0, best.1)
}
