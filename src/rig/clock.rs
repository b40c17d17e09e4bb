//! The one clock of a capture: microseconds of the system's monotonic clock.
//!
//! Cameras stamp their frames with this clock (V4L2 does so in the kernel), and the turntable's
//! angles are fitted against it, so that both meet on one axis. It does not follow changes of the
//! time of day. A rehearsal without hardware may run it faster than real time; then simulated
//! table, replayed camera and everything that waits share one such clock.
//!
//! Knows nobody.

use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// Microseconds of the monotonic clock, at its own pace or faster.
///
/// Copies of a clock agree with each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    start_us: i64,
    factor: f64,
}

impl Clock {
    /// The system's monotonic clock as it is: comparable with the kernel's time stamps.
    pub fn monotonic() -> Clock {
        Clock {
            start_us: 0,
            factor: 1.0,
        }
    }

    /// A clock that agrees with the monotonic one now and runs `factor` times as fast from here.
    ///
    /// A factor that is not a positive number counts as 1.
    pub fn scaled(factor: f64) -> Clock {
        let usable = factor.is_finite() && factor > 0.0;
        Clock {
            start_us: monotonic_us(),
            factor: if usable { factor } else { 1.0 },
        }
    }

    /// How many times faster than real time this clock runs.
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Microseconds now.
    pub fn now_us(&self) -> i64 {
        self.at_monotonic_us(monotonic_us())
    }

    /// What this clock shows when the system's monotonic clock shows `us`.
    pub fn at_monotonic_us(&self, us: i64) -> i64 {
        if self.factor == 1.0 {
            return us;
        }
        let since_start = us.saturating_sub(self.start_us) as f64;
        self.start_us
            .saturating_add((since_start * self.factor) as i64)
    }

    /// How long to wait in real time until this clock has gone on by `own`.
    pub fn real(&self, own: Duration) -> Duration {
        own.div_f64(self.factor.max(f64::MIN_POSITIVE))
    }

    /// Waits until this clock has gone on by `own`.
    pub fn sleep(&self, own: Duration) {
        std::thread::sleep(self.real(own));
    }
}

fn monotonic_us() -> i64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec
        .saturating_mul(1_000_000)
        .saturating_add(now.tv_nsec / 1000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_monotonic_clock_goes_forward_in_microseconds() {
        let clock = Clock::monotonic();
        let before = clock.now_us();
        clock.sleep(Duration::from_millis(20));
        assert!((20_000..5_000_000).contains(&(clock.now_us() - before)));
    }

    #[test]
    fn a_scaled_clock_starts_with_the_monotonic_one_and_runs_ahead_of_it() {
        let scaled = Clock::scaled(50.0);
        let start = scaled.at_monotonic_us(scaled.start_us);
        assert_eq!(start, scaled.start_us);
        assert_eq!(scaled.at_monotonic_us(start + 1000), start + 50_000);
        assert_eq!(scaled.real(Duration::from_secs(50)), Duration::from_secs(1));
    }

    #[test]
    fn copies_of_a_clock_agree() {
        let one = Clock::scaled(7.5);
        let other = one;
        assert_eq!(
            one.at_monotonic_us(123_456_789),
            other.at_monotonic_us(123_456_789)
        );
    }

    #[test]
    fn a_factor_that_is_no_speed_counts_as_real_time() {
        for factor in [0.0, -2.0, f64::NAN, f64::INFINITY] {
            assert_eq!(Clock::scaled(factor).factor(), 1.0);
        }
    }
}
