//! The order of the samples in a shard: any 12 consecutive samples cover the whole turn.
//!
//! Position `j` of `n` holds sample `j * s mod n`, with one stride `s` for the whole shard. The
//! stride is the number coprime to `n` that is nearest to `n * (5/12 + 0.618034/144)` among those
//! with which no 12 consecutive samples leave a gap of more than 45 degrees. Twelve steps of 5/12 of a
//! turn would visit each of the twelve hours of a clock face once; the golden section of 1/144 keeps
//! the next twelve from visiting the same hours, and spreads shorter runs too. For 1500 samples `s` is
//! 631: any 12 consecutive samples leave gaps of at most 37.2 degrees, any 7 of at most 57.1.
//!
//! For 13, 14, 15 and 22 samples, and for fewer than 8, no stride keeps the gaps within 45 degrees;
//! then the nearest coprime number is used.

use std::num::NonZeroU32;

/// Number of consecutive samples that should cover the turn.
const RUN: u32 = 12;
/// The ideal stride as a fraction of the turn, 5/12 + 0.618034/144, in units of 1/144 000 000: the
/// choice is made in integers and is the same on every machine.
const AIM: i128 = 60_618_034;
const AIM_UNITS: i128 = 144_000_000;

/// The sample at each position of a shard of `samples` samples: a permutation of `0..samples`.
/// Empty for 0.
pub fn order(samples: u32) -> Vec<u32> {
    let Some(count) = NonZeroU32::new(samples) else {
        return Vec::new();
    };
    let stride = u64::from(stride(count));
    (0..u64::from(samples))
        .filter_map(|j| u32::try_from(j * stride % u64::from(samples)).ok())
        .collect()
}

/// The stride of the permutation for `count` samples, `1..=count`.
fn stride(count: NonZeroU32) -> u32 {
    let n = count.get();
    let mut nearest = None;
    for candidate in by_distance_from_aim(n) {
        if gcd(candidate, n) != 1 {
            continue;
        }
        if u64::from(largest_gap(n, candidate)) * 8 <= u64::from(n) {
            return candidate;
        }
        nearest.get_or_insert(candidate);
    }
    nearest.unwrap_or(1)
}

/// The numbers `1..=n`, nearest to the ideal stride first.
fn by_distance_from_aim(n: u32) -> impl Iterator<Item = u32> {
    let aim = i128::from(n) * AIM;
    let distance = move |s: u32| (i128::from(s) * AIM_UNITS - aim).abs();
    let mut below = u32::try_from(aim / AIM_UNITS).unwrap_or(n).min(n);
    let mut above = below + 1;
    std::iter::from_fn(move || {
        let take_below = below >= 1 && (above > n || distance(below) <= distance(above));
        if take_below {
            below -= 1;
            Some(below + 1)
        } else if above <= n {
            above += 1;
            Some(above - 1)
        } else {
            None
        }
    })
}

/// The largest gap that 12 consecutive samples leave on the circle of `n` samples. All runs are
/// rotations of one another, so it is enough to look at the first.
fn largest_gap(n: u32, stride: u32) -> u32 {
    let mut run: Vec<u32> = (0..u64::from(RUN.min(n)))
        .filter_map(|j| u32::try_from(j * u64::from(stride) % u64::from(n)).ok())
        .collect();
    run.sort_unstable();
    let around = match (run.first(), run.last()) {
        (Some(first), Some(last)) => n - last + first,
        _ => n,
    };
    run.windows(2)
        .map(|pair| pair[1] - pair[0])
        .fold(around, u32::max)
}

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Largest gap between any `run` consecutive samples of `order`, degrees.
    fn worst_gap(order: &[u32], run: usize) -> f64 {
        let n = u32::try_from(order.len()).unwrap();
        let mut worst = 0;
        for window in order.windows(run) {
            let mut sorted = window.to_vec();
            sorted.sort_unstable();
            let around = n - sorted[run - 1] + sorted[0];
            let inside = sorted.windows(2).map(|w| w[1] - w[0]).max().unwrap_or(n);
            worst = worst.max(around).max(inside);
        }
        f64::from(worst) * 360.0 / f64::from(n)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]
        #[test]
        fn the_order_is_a_permutation(n in 0_u32..4000) {
            let mut sorted = order(n);
            sorted.sort_unstable();
            prop_assert_eq!(sorted, (0..n).collect::<Vec<_>>());
        }

        #[test]
        fn any_twelve_consecutive_samples_cover_the_turn(n in 100_u32..4000) {
            prop_assert!(worst_gap(&order(n), 12) <= 45.0);
        }
    }

    #[test]
    fn a_turn_of_1500_has_the_documented_figures() {
        let order = order(1500);
        assert_eq!(order[..3], [0, 631, 1262]);
        assert!((worst_gap(&order, 12) - 37.2).abs() < 1e-9);
        assert!((worst_gap(&order, 7) - 57.12).abs() < 1e-9);
    }

    #[test]
    fn small_turns_have_an_order_too() {
        for n in 1..100 {
            let mut sorted = order(n);
            sorted.sort_unstable();
            assert_eq!(sorted, (0..n).collect::<Vec<_>>(), "{n}");
        }
    }

    #[test]
    fn only_the_documented_sizes_leave_more_than_45_degrees() {
        let wide: Vec<u32> = (12..400)
            .filter(|&n| worst_gap(&order(n), 12) > 45.0 + 1e-9)
            .collect();
        assert_eq!(wide, [13, 14, 15, 22]);
    }
}
