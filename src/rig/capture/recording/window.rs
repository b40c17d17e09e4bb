//! The time in which the frames of a turn are exposed.

/// From the first instant of a turn up to, but not with, the last; microseconds of the clock that
/// stamps the frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    from_us: i64,
    to_us: i64,
}

impl Window {
    /// A window of `us` microseconds, at least one, from `from_us` on.
    #[must_use]
    pub fn lasting(from_us: i64, us: i64) -> Self {
        let from_us = from_us.min(i64::MAX - 1);
        Self {
            from_us,
            to_us: from_us.saturating_add(us.max(1)),
        }
    }

    /// When it begins, microseconds.
    #[must_use]
    pub fn from_us(self) -> i64 {
        self.from_us
    }

    /// When it is over, microseconds.
    #[must_use]
    pub fn to_us(self) -> i64 {
        self.to_us
    }
}
