//! Medians of many series at once, by a sorting network (Batcher, "Sorting networks and their applications", 1968).
//!
//! A network compares the same places whatever the values are, so that the series lie side by side and each comparison
//! becomes two vector instructions.

use pulp::{Arch, Simd, WithSimd};

/// Series that are sorted together.
pub(super) const LANES: usize = 16;

/// A value of each series.
pub(super) type Lanes = [f32; LANES];

/// Finds the medians of series of one length, for an even one the upper one; 0 of nothing.
#[derive(Debug)]
pub(super) struct Medians {
    length: usize,
    /// The places that are compared, as far as the one in the middle depends on it.
    comparisons: Vec<(usize, usize)>,
    keys: Vec<[i32; LANES]>,
}

impl Medians {
    pub(super) fn new(length: usize) -> Self {
        let mut needed = vec![false; length];
        if let Some(middle) = needed.get_mut(length / 2) {
            *middle = true;
        }
        let mut comparisons = sorting(length);
        comparisons.reverse();
        comparisons.retain(|&(low, high)| {
            let counts = needed[low] || needed[high];
            if counts {
                (needed[low], needed[high]) = (true, true);
            }
            counts
        });
        comparisons.reverse();
        Self {
            length,
            comparisons,
            keys: Vec::new(),
        }
    }

    /// The medians, in the order of [`f32::total_cmp`], of this many values of each series.
    pub(super) fn of(&mut self, values: &[Lanes]) -> Lanes {
        let values = values.get(..self.length).unwrap_or_default();
        self.keys.clear();
        self.keys.extend(values.iter().map(|lanes| lanes.map(key)));
        Arch::new().dispatch(Sorting {
            comparisons: &self.comparisons,
            keys: &mut self.keys,
        });
        let middle = self.keys.get(self.length / 2);
        middle.map_or([0.0; LANES], |keys| keys.map(value))
    }
}

/// A whole number in whose order values are in that of [`f32::total_cmp`].
fn key(value: f32) -> i32 {
    let bits = value.to_bits().cast_signed();
    bits ^ (bits >> 31) & i32::MAX
}

fn value(key: i32) -> f32 {
    f32::from_bits((key ^ (key >> 31) & i32::MAX).cast_unsigned())
}

/// The comparisons that sort a series: Knuth, "The Art of Computer Programming", volume 3, algorithm 5.2.2 M.
fn sorting(length: usize) -> Vec<(usize, usize)> {
    let mut comparisons = Vec::new();
    let most = length.next_power_of_two() / 2;
    let mut step = most;
    while step > 0 {
        let (mut reach, mut rest, mut apart) = (most, 0, step);
        loop {
            let pairs = (0..length.saturating_sub(apart)).filter(|low| low & step == rest);
            comparisons.extend(pairs.map(|low| (low, low + apart)));
            if reach == step {
                break;
            }
            apart = reach - step;
            reach /= 2;
            rest = step;
        }
        step /= 2;
    }
    comparisons
}

/// Compiled for the kind of processor.
struct Sorting<'a> {
    comparisons: &'a [(usize, usize)],
    keys: &'a mut [[i32; LANES]],
}

impl WithSimd for Sorting<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for &(low, high) in self.comparisons {
            let (a, b) = (self.keys[low], self.keys[high]);
            for ((low, a), b) in self.keys[low].iter_mut().zip(a).zip(b) {
                *low = a.min(b);
            }
            for ((high, a), b) in self.keys[high].iter_mut().zip(a).zip(b) {
                *high = a.max(b);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn selected(mut values: Vec<f32>) -> f32 {
        let at = values.len() / 2;
        *values.select_nth_unstable_by(at, f32::total_cmp).1
    }

    proptest! {
        #[test]
        fn medians_are_those_of_each_series_to_the_last_bit(
            values in prop::collection::vec(prop::array::uniform16(any::<f32>()), 1..45),
        ) {
            let found = Medians::new(values.len()).of(&values);
            for (lane, found) in found.into_iter().enumerate() {
                let series = values.iter().map(|lanes| lanes[lane]).collect();
                prop_assert_eq!(found.to_bits(), selected(series).to_bits());
            }
        }

        #[test]
        fn what_is_zero_or_not_a_number_is_in_order_too(
            values in prop::collection::vec(
                prop::array::uniform16(prop::sample::select(vec![
                    0.0, -0.0, 1.0, -1.0, f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY,
                ])),
                1..10,
            ),
        ) {
            let found = Medians::new(values.len()).of(&values);
            for (lane, found) in found.into_iter().enumerate() {
                let series = values.iter().map(|lanes| lanes[lane]).collect();
                prop_assert_eq!(found.to_bits(), selected(series).to_bits());
            }
        }
    }

    #[test]
    fn of_nothing_the_median_is_zero() {
        assert_eq!(Medians::new(0).of(&[]), [0.0; LANES]);
    }
}
