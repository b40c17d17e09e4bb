//! Frame rates.

use std::fmt;

/// Frames per second, as a fraction of positive numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Rate {
    numerator: u32,
    denominator: u32,
}

impl Rate {
    /// `numerator / denominator` frames a second; `None` if either is 0.
    pub fn new(numerator: u32, denominator: u32) -> Option<Self> {
        (numerator > 0 && denominator > 0).then_some(Self {
            numerator,
            denominator,
        })
    }

    /// The upper number.
    pub fn numerator(self) -> u32 {
        self.numerator
    }

    /// The lower number.
    pub fn denominator(self) -> u32 {
        self.denominator
    }

    /// Frames per second.
    pub fn per_second(self) -> f64 {
        f64::from(self.numerator) / f64::from(self.denominator)
    }

    /// True if both are the same number.
    pub fn equals(self, other: Self) -> bool {
        u64::from(self.numerator) * u64::from(other.denominator)
            == u64::from(other.numerator) * u64::from(self.denominator)
    }

    /// The nearest fraction in thousandths of a frame a second, whole where it is whole;
    /// `None` outside of a thousandth to a million frames a second.
    pub fn from_per_second(per_second: f64) -> Option<Self> {
        if !(0.001..=1e6).contains(&per_second) {
            return None;
        }
        let thousandths = (per_second * 1000.0).round() as u32;
        if thousandths.is_multiple_of(1000) {
            return Self::new(thousandths / 1000, 1);
        }
        // 29.97 and similar rates mean n * 1000 / 1001.
        let whole = per_second.ceil();
        if (whole * 1000.0 / 1001.0 - per_second).abs() < 0.001 {
            return Self::new(whole as u32 * 1000, 1001);
        }
        Self::new(thousandths, 1000)
    }
}

impl fmt::Display for Rate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.numerator.is_multiple_of(self.denominator) {
            return write!(f, "{}", self.numerator / self.denominator);
        }
        write!(f, "{:.3}", self.per_second())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_of_television_are_exact() {
        let found = |per_second| Rate::from_per_second(per_second).unwrap();
        for (per_second, numerator, denominator) in [
            (30.0, 30, 1),
            (29.97, 30_000, 1001),
            (59.94, 60_000, 1001),
            (23.976, 24_000, 1001),
            (7.5, 15, 2),
            (0.001, 1, 1000),
        ] {
            let wanted = Rate::new(numerator, denominator).unwrap();
            assert!(found(per_second).equals(wanted), "{per_second}");
        }
        for none in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e7] {
            assert_eq!(Rate::from_per_second(none), None);
        }
        assert_eq!((Rate::new(0, 1), Rate::new(1, 0)), (None, None));
    }
}
