//! Speed in whole steps: the ramp index.
//!
//! Under constant acceleration from rest v^2 = 2 a n after n steps, so the number of steps since
//! standstill (or to it) *is* the speed. Between index n and n + 1 lies the interval c(n), and
//! D. Austin's recurrence gives one from the other with one division ("Generate stepper-motor
//! speed profiles in real time", Embedded Systems Programming, January 2005; also Atmel AVR446):
//!
//! ```text
//! c(0) = 0.676 f sqrt(2 / a),    c(n) = c(n-1) - 2 c(n-1) / (4 n + 1)
//! ```
//!
//! Intervals are in 256ths of a timer tick; a tick is half a microsecond. Knows no other module.

/// Timer ticks a second.
pub(crate) const TICKS_PER_SECOND: u32 = 2_000_000;
/// Most steps a second.
pub(crate) const MAX_STEP_RATE: u32 = 10_000;
/// Parts of a tick in a minute, times a million.
const PARTS_PER_MINUTE: u64 = TICKS_PER_SECOND as u64 * 256 * 60 * 1_000_000;
/// 0.676 f sqrt(2 / a) in 256ths of a tick, where a is a thousandth of a step/s^2.
const FIRST: u64 = 15_478_600_000;
/// Above any speed, in thousandths of a step/s.
const MAX_SPEED: u32 = 100_000_000;
/// Above any ramp index, and four times it fits 32 bits.
const MAX_INDEX: u32 = u32::MAX / 8;
/// The longest interval: more, and the carried fraction would not fit.
const MAX_INTERVAL: u32 = 0xFFFF_FF00;
/// The longest first interval of a ramp: twice it, and a remainder, fit 32 bits.
const MAX_FIRST: u32 = 1 << 30;

/// A steady speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Cruise {
    /// Interval between steps, in 256ths of a tick.
    pub interval: u32,
    /// The ramp index just below this speed.
    pub index: u32,
}

/// The motion limits of the table, in steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Profile {
    /// Steps a degree, in thousandths.
    steps_per_degree: u32,
    /// Acceleration in thousandths of a step/s^2.
    acceleration: u32,
    /// c(0).
    first: u32,
}

impl Profile {
    /// From thousandths of steps/degree and of degrees/s^2; both are positive.
    pub(crate) fn new(steps_per_degree: u32, acceleration: u32) -> Profile {
        let product = u64::from(steps_per_degree) * u64::from(acceleration);
        let acceleration = u32::try_from(product / 1000).unwrap_or(u32::MAX).max(1);
        // Scaled by fours, so that its root has sixteen digits in base two.
        let (mut scaled, mut twos) = (acceleration, 1_u64);
        while scaled < 1 << 30 {
            scaled <<= 2;
            twos *= 2;
        }
        let first = FIRST * twos / u64::from(root(scaled).max(1));
        Profile {
            steps_per_degree,
            acceleration,
            first: u32::try_from(first)
                .unwrap_or(MAX_FIRST)
                .clamp(1, MAX_FIRST),
        }
    }

    /// The interval and the ramp index of a speed in thousandths of a degree/min. A speed below
    /// one step in 8 s counts as that.
    pub(crate) fn cruise(&self, feed: u32) -> Cruise {
        // Thousandths times thousandths: millionths of a step/min.
        let rate = u64::from(feed.max(1)) * u64::from(self.steps_per_degree.max(1));
        let interval = (PARTS_PER_MINUTE + rate / 2) / rate;
        let interval = u32::try_from(interval).map_or(MAX_INTERVAL, |it| it.min(MAX_INTERVAL));
        let millisteps = u32::try_from(rate / 60_000).map_or(MAX_SPEED, |it| it.min(MAX_SPEED));
        let index = u64::from(millisteps).pow(2) / 2000 / u64::from(self.acceleration);
        let mut index = u32::try_from(index).map_or(MAX_INDEX, |it| it.min(MAX_INDEX));
        if index == 0 && interval < self.first {
            // Not from rest to this speed within less than the first interval.
            index = 1;
        }
        Cruise { interval, index }
    }

    /// The speed at which steps come at `interval`, in thousandths of a degree/min.
    pub(crate) fn feed(&self, interval: u32) -> u32 {
        let rate = u64::from(interval) * u64::from(self.steps_per_degree);
        u32::try_from(PARTS_PER_MINUTE.checked_div(rate).unwrap_or(0)).unwrap_or(u32::MAX)
    }

    /// The first interval from rest, in 256ths of a tick.
    pub(crate) fn first_interval(&self) -> u32 {
        self.first
    }
}

/// The integer square root, digit by digit in base two.
fn root(square: u32) -> u32 {
    let mut rest = square;
    let mut root = 0_u32;
    let mut bit = 1_u32 << 30;
    while bit != 0 {
        if rest >= root + bit {
            rest -= root + bit;
            root = (root >> 1) + bit;
        } else {
            root >>= 1;
        }
        bit >>= 2;
    }
    root
}

/// Where on the ramp the table is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Ramp {
    first: u32,
    index: u32,
    /// c(index)
    interval: u32,
    /// What the last division left, so that long ramps stay true where a step changes the interval
    /// by less than a 256th of a tick.
    remainder: u32,
    falling: bool,
}

impl Ramp {
    /// At standstill, with the first interval of the acceleration.
    pub(crate) const fn at_rest(first: u32) -> Ramp {
        Ramp {
            first,
            index: 0,
            interval: first,
            remainder: 0,
            falling: false,
        }
    }

    /// Back to standstill.
    pub(crate) fn rest(&mut self) {
        *self = Ramp::at_rest(self.first);
    }

    /// Steps since standstill, and to it.
    pub(crate) fn index(&self) -> u32 {
        self.index
    }

    /// The interval of the step from this index to the next.
    pub(crate) fn interval(&self) -> u32 {
        self.interval
    }

    /// Goes one step up the ramp, and gives that step's interval.
    pub(crate) fn up(&mut self) -> u32 {
        let interval = self.interval;
        self.index = self.index.saturating_add(1);
        let change = self.change(false, self.index.saturating_mul(4).saturating_add(1));
        self.interval = interval.saturating_sub(change).max(1);
        interval
    }

    /// Goes one step down the ramp, and gives that step's interval.
    pub(crate) fn down(&mut self) -> u32 {
        let divisor = self.index.saturating_mul(4).saturating_sub(1).max(1);
        self.index = self.index.saturating_sub(1);
        if self.index == 0 {
            self.rest();
        } else {
            let change = self.change(true, divisor);
            self.interval = self.interval.saturating_add(change).min(self.first);
        }
        self.interval
    }

    /// 2 c / divisor, with the remainder of the step before where that went the same way.
    fn change(&mut self, falling: bool, divisor: u32) -> u32 {
        if self.falling != falling {
            self.falling = falling;
            self.remainder = divisor / 2;
        }
        let dividend = (self.interval * 2).saturating_add(self.remainder);
        let change = dividend.checked_div(divisor).unwrap_or(0);
        self.remainder = dividend.wrapping_sub(change.wrapping_mul(divisor));
        change
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEPS_PER_DEGREE: u32 = 88_889;
    const ACCELERATION: u32 = 36_000;

    fn profile() -> Profile {
        Profile::new(STEPS_PER_DEGREE, ACCELERATION)
    }

    #[test]
    fn a_speed_becomes_its_interval_and_its_distance_from_standstill() {
        let cruise = profile().cruise(432_000);
        // 7.2 degrees/s * 88.889 = 640.0 steps/s = 3125 ticks; 640^2 / (2 * 3200.004) = 63.99.
        assert_eq!(cruise.interval.div_ceil(256), 3125);
        assert_eq!(cruise.index, 63);
        assert_eq!((profile().feed(cruise.interval) + 50) / 1000, 432);
    }

    #[test]
    fn intervals_follow_constant_acceleration() {
        let a = f64::from(ACCELERATION) / 1000.0 * f64::from(STEPS_PER_DEGREE) / 1000.0;
        let mut ramp = Ramp::at_rest(profile().first_interval());
        for n in 0_i32..5000 {
            let got = f64::from(ramp.up()) / 256.0;
            let exact = 2e6 * (2.0 / a).sqrt() * (f64::from(n + 1).sqrt() - f64::from(n).sqrt());
            // The correction of the first interval dies out within a few steps.
            if n > 4 {
                assert!((got / exact - 1.0).abs() < 0.002, "{n}: {got} {exact}");
            }
        }
    }

    #[test]
    fn a_long_gentle_ramp_keeps_its_acceleration() {
        let profile = Profile::new(500_000, 1000);
        let mut ramp = Ramp::at_rest(profile.first_interval());
        let mut interval = 0;
        for _ in 0..50_000 {
            interval = ramp.up();
        }
        let speed = 2e6 * 256.0 / f64::from(interval);
        let exact = (2.0_f64 * 500.0 * 50_000.0).sqrt();
        assert!((speed / exact - 1.0).abs() < 0.003, "{speed} {exact}");
    }

    #[test]
    fn the_way_down_mirrors_the_way_up() {
        let mut ramp = Ramp::at_rest(profile().first_interval());
        let mut up = [0; 300];
        up.iter_mut().for_each(|interval| *interval = ramp.up());
        for expected in up.iter().rev() {
            let got = ramp.down();
            assert!(got.abs_diff(*expected) <= expected / 10_000 + 4, "{got}");
        }
        assert_eq!(ramp, Ramp::at_rest(profile().first_interval()));
    }

    #[test]
    fn a_slow_speed_needs_no_ramp_and_one_just_above_the_first_interval_takes_one_step() {
        let profile = profile();
        assert_eq!(profile.cruise(1000).index, 0);
        let edge = profile.feed(profile.first_interval());
        assert_eq!(profile.cruise(edge - 100).index, 0);
        assert_eq!(profile.cruise(edge + 100).index, 1);
    }

    #[test]
    fn extreme_settings_stay_within_their_numbers() {
        for (steps, acceleration, feed) in [(1, 1, 1), (1_000_000, i32::MAX as u32, 600_000)] {
            let profile = Profile::new(steps, acceleration);
            assert!(profile.first_interval() <= 1 << 30);
            let cruise = profile.cruise(feed);
            assert!(cruise.interval <= 0xFFFF_FF00);
            assert!(profile.cruise(u32::MAX).index <= u32::MAX / 8);
        }
    }
}
