//! Order statistics of samples: medians and the like.
//!
//! All of them are samples themselves, by the nearest rank. Nothing is interpolated. Samples are compared by the total
//! order of floating-point numbers.

/// The sample that has `rank` others before it, from 0; the largest where there are fewer. `None` if there are no
/// samples. The samples are left in another order.
pub fn ranked<T: Copy + Into<f64>>(samples: &mut [T], rank: usize) -> Option<T> {
    let last = samples.len().checked_sub(1)?;
    let order = |a: &T, b: &T| (*a).into().total_cmp(&(*b).into());
    let (_, found, _) = samples.select_nth_unstable_by(rank.min(last), order);
    Some(*found)
}

/// The sample that this part of all, 0 to 1, lies below; `None` without samples.
pub fn above_part<T: Copy + Into<f64>>(
    samples: impl IntoIterator<Item = T>,
    part: f64,
) -> Option<T> {
    let mut samples: Vec<T> = samples.into_iter().collect();
    let rank = (samples.len() as f64 * part) as usize;
    ranked(&mut samples, rank)
}

/// The sample in the middle, the lower of two; `None` without samples.
pub fn median<T: Copy + Into<f64>>(samples: impl IntoIterator<Item = T>) -> Option<T> {
    let mut samples: Vec<T> = samples.into_iter().collect();
    let rank = samples.len().saturating_sub(1) / 2;
    ranked(&mut samples, rank)
}

/// The sample in the middle, the upper of two; `None` without samples.
pub fn upper_median<T: Copy + Into<f64>>(samples: impl IntoIterator<Item = T>) -> Option<T> {
    let mut samples: Vec<T> = samples.into_iter().collect();
    let rank = samples.len() / 2;
    ranked(&mut samples, rank)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_samples() {
        assert_eq!(median([3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median([4.0, 1.0, 2.0, 3.0]), Some(2.0));
        assert_eq!(upper_median([4.0_f32, 1.0, 2.0, 3.0]), Some(3.0));
        assert_eq!(upper_median([1.0]), Some(1.0));
    }

    #[test]
    fn a_part_of_the_samples_lies_below_the_one_above_it() {
        let tens = || (0..10).map(f64::from);
        assert_eq!(above_part(tens(), 0.0), Some(0.0));
        assert_eq!(above_part(tens(), 0.9), Some(9.0));
        assert_eq!(above_part(tens(), 2.0), Some(9.0));
    }

    #[test]
    fn there_is_no_statistic_of_nothing() {
        assert_eq!(median(Vec::<f64>::new()), None);
        assert_eq!(upper_median(Vec::<f32>::new()), None);
        assert_eq!(ranked::<f64>(&mut [], 3), None);
    }
}
