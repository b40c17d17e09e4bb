//! A straight line through time stamps: exposure number against time.

/// Exposure numbers farther than this from the first are cut off: sums of them stay exact.
pub(super) const FARTHEST: i64 = 1 << 50;

/// Exposure `s` is due at `start + period * s`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    pub(super) start: f64,
    pub(super) period: f64,
}

impl Line {
    /// The least-squares line; `None` if all numbers are equal, or the line falls.
    pub(super) fn through(numbers: &[i64], times: &[f64]) -> Option<Self> {
        let count = numbers.len() as f64;
        let mean = |sum: f64| sum / count;
        let middle = mean(numbers.iter().map(|&n| n as f64).sum());
        let mean_time = mean(times.iter().sum());
        let (mut product, mut square) = (0.0, 0.0);
        for (&number, &time) in numbers.iter().zip(times) {
            let off = number as f64 - middle;
            product += off * (time - mean_time);
            square += off * off;
        }
        let period = product / square;
        (period.is_finite() && period > 0.0).then_some(Self {
            start: mean_time - period * middle,
            period,
        })
    }

    /// How far `time` is from where exposure `number` is due, in periods.
    pub(super) fn off(self, number: i64, time: f64) -> f64 {
        (time - self.start) / self.period - number as f64
    }

    /// The exposure due nearest to `time`.
    pub(super) fn nearest(self, time: f64) -> i64 {
        let number = ((time - self.start) / self.period).round();
        number.clamp(-FARTHEST as f64, FARTHEST as f64) as i64
    }
}
