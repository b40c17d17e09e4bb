//! Two images of one size and the pixels that count, checked once.

use super::MetricError;
use crate::image::Extent;

/// A ground truth and an estimate with the same channels, finite at each pixel under a mask that is not
/// empty. Values elsewhere are never looked at.
#[derive(Debug, Clone)]
pub struct Comparison<'a> {
    pub(super) extent: Extent,
    pub(super) channels: Vec<Channel<'a>>,
    pub(super) mask: &'a [bool],
}

/// One channel of both images.
#[derive(Debug, Clone, Copy)]
pub(super) struct Channel<'a> {
    pub(super) truth: &'a [f32],
    pub(super) estimate: &'a [f32],
}

impl<'a> Comparison<'a> {
    /// Compares the planes of `estimate` with those of `truth`, each row by row and `extent` in
    /// size, at the pixels where `mask` is true.
    ///
    /// # Errors
    /// [`MetricError::EmptyMask`], or [`MetricError::Incomparable`] if sizes or channels differ or a value under the mask
    /// is not finite.
    pub fn new(
        extent: Extent,
        truth: &[&'a [f32]],
        estimate: &[&'a [f32]],
        mask: &'a [bool],
    ) -> Result<Self, MetricError> {
        check_length("the mask", mask.len(), extent)?;
        check_plane("the ground truth", truth, extent, mask)?;
        check_plane("the estimate", estimate, extent, mask)?;
        if truth.len() != estimate.len() || truth.is_empty() {
            return Err(MetricError::Incomparable(format!(
                "the ground truth has {} channels and the estimate {}: they cannot be compared",
                truth.len(),
                estimate.len()
            )));
        }
        if !mask.contains(&true) {
            return Err(MetricError::EmptyMask);
        }
        let pairs = truth.iter().zip(estimate);
        Ok(Self {
            extent,
            channels: pairs
                .map(|(truth, estimate)| Channel { truth, estimate })
                .collect(),
            mask,
        })
    }

    /// Number of pixels that count, at least 1.
    pub fn count(&self) -> usize {
        self.mask.iter().filter(|&&counts| counts).count()
    }
}

impl<'a> Channel<'a> {
    /// Ground truth and estimate of each pixel under the mask.
    pub(super) fn under(self, mask: &'a [bool]) -> impl Iterator<Item = (f64, f64)> {
        self.truth
            .iter()
            .zip(self.estimate)
            .zip(mask)
            .filter(|(_, counts)| **counts)
            .map(|((&truth, &estimate), _)| (f64::from(truth), f64::from(estimate)))
    }
}

pub(super) fn check_length(
    what: &'static str,
    found: usize,
    extent: Extent,
) -> Result<(), MetricError> {
    let expected = extent.pixels();
    if found == expected {
        return Ok(());
    }
    Err(MetricError::Incomparable(format!(
        "{what} has {found} values instead of {expected}: the images differ in size"
    )))
}

pub(super) fn not_finite(what: &str, value: f32, [x, y]: [usize; 2]) -> MetricError {
    MetricError::Incomparable(format!(
        "{what} has the value {value} at pixel ({x}, {y}): only finite values can be compared"
    ))
}

fn check_plane(
    what: &'static str,
    planes: &[&[f32]],
    extent: Extent,
    mask: &[bool],
) -> Result<(), MetricError> {
    for plane in planes {
        check_length(what, plane.len(), extent)?;
        let odd = plane
            .iter()
            .zip(mask)
            .position(|(value, &counts)| counts && !value.is_finite());
        if let Some(at) = odd {
            return Err(not_finite(
                what,
                plane[at],
                [at % extent.width, at / extent.width],
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXTENT: Extent = Extent::new(3, 2);

    #[test]
    fn images_of_other_sizes_are_refused() {
        let (values, mask) = ([0.0; 6], [true; 6]);
        assert!(Comparison::new(EXTENT, &[&values], &[&values], &mask).is_ok());
        for (truth, estimate, mask, what) in [
            (&values[..], &values[..], &mask[..5], "mask"),
            (&values[..4], &values[..], &mask[..], "ground truth"),
            (&values[..], &values[..5], &mask[..], "estimate"),
        ] {
            let error = Comparison::new(EXTENT, &[truth], &[estimate], mask).unwrap_err();
            assert!(matches!(error, MetricError::Incomparable(_)), "{error:?}");
            assert!(error.to_string().contains(what), "{error}");
        }
        for truth in [&[][..], &[&values[..], &values]] {
            let error = Comparison::new(EXTENT, truth, &[&values], &mask).unwrap_err();
            assert!(error.to_string().contains("channels"), "{error}");
        }
    }

    #[test]
    fn a_mask_without_a_pixel_is_refused() {
        let found = Comparison::new(EXTENT, &[&[0.0; 6]], &[&[0.0; 6]], &[false; 6]);
        assert_eq!(found.unwrap_err(), MetricError::EmptyMask);
        let found = Comparison::new(Extent::new(0, 0), &[&[]], &[&[]], &[]);
        assert_eq!(found.unwrap_err(), MetricError::EmptyMask);
    }

    #[test]
    fn a_value_that_is_no_number_is_named_by_its_pixel_and_only_under_the_mask() {
        let mut estimate = [0.0; 6];
        estimate[4] = f32::NAN;
        let mut mask = [true; 6];
        let error = Comparison::new(EXTENT, &[&[0.0; 6]], &[&estimate], &mask).unwrap_err();
        for named in ["estimate", "NaN", "(1, 1)"] {
            assert!(error.to_string().contains(named), "{named}: {error}");
        }
        mask[4] = false;
        assert!(Comparison::new(EXTENT, &[&[0.0; 6]], &[&estimate], &mask).is_ok());
    }
}
