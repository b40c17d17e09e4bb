//! WHDR: how often an estimated reflectance contradicts what people judged.

use super::MetricError;
use super::comparison::{check_length, not_finite};
use crate::image::Extent;

/// What people judged of two points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Darker {
    /// The first point has the darker surface.
    First,
    /// The second has.
    Second,
    /// Both are about the same.
    Neither,
}

/// A judgement about two points of an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judgement {
    /// The first point, right and down from the upper left corner, as fractions of the image's
    /// width and height, 0..=1.
    pub first: [f64; 2],
    /// The second.
    pub second: [f64; 2],
    /// Which was judged to be darker.
    pub darker: Darker,
    /// How sure people were; one of 0 or less does not count.
    pub weight: f64,
}

/// The weighted human disagreement rate of Bell et al. (2014), 0..=1: the weight of the judgements
/// that a reflectance contradicts, in relation to the weight of all. A point is called darker where
/// the other is brighter by more than the factor 1 + `delta` (0.1 in the publication); brightness
/// is the mean of a pixel's channels, linear, at least 1e-10.
///
/// # Errors
/// [`MetricError::EmptyMask`] for an image without values; [`MetricError::Incomparable`] where a plane has another length, a
/// value is not finite, a point lies outside, or no judgement has a weight.
pub fn whdr(
    extent: Extent,
    reflectance: &[&[f32]],
    judgements: &[Judgement],
    delta: f64,
) -> Result<f64, MetricError> {
    if extent.pixels() == 0 || reflectance.is_empty() {
        return Err(MetricError::EmptyMask);
    }
    for plane in reflectance {
        check_length("the estimate", plane.len(), extent)?;
    }
    let (mut wrong, mut all) = (0.0, 0.0);
    for judgement in judgements.iter().filter(|judged| judged.weight > 0.0) {
        let first = brightness(extent, reflectance, judgement.first)?;
        let second = brightness(extent, reflectance, judgement.second)?;
        let darker = if second / first > 1.0 + delta {
            Darker::First
        } else if first / second > 1.0 + delta {
            Darker::Second
        } else {
            Darker::Neither
        };
        all += judgement.weight;
        if darker != judgement.darker {
            wrong += judgement.weight;
        }
    }
    if all > 0.0 {
        Ok(wrong / all)
    } else {
        Err(MetricError::Incomparable(
            "no judgement has a positive weight: there is nothing to agree with".to_owned(),
        ))
    }
}

fn brightness(
    extent: Extent,
    reflectance: &[&[f32]],
    [x, y]: [f64; 2],
) -> Result<f64, MetricError> {
    if !((0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y)) {
        return Err(MetricError::Incomparable(format!(
            "a judgement names the point ({x}, {y}), which is outside an image of 1x1"
        )));
    }
    let place = |at: f64, length: usize| ((at * length as f64) as usize).min(length - 1);
    let (x, y) = (place(x, extent.width), place(y, extent.height));
    let mut sum = 0.0;
    for plane in reflectance {
        let value = plane[y * extent.width + x];
        if !value.is_finite() {
            return Err(not_finite("the estimate", value, [x, y]));
        }
        sum += f64::from(value);
    }
    Ok((sum / reflectance.len() as f64).max(1e-10))
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXTENT: Extent = Extent::new(3, 1);
    const STEPS: &[&[f32]] = &[&[0.1, 0.105, 0.5]];

    fn judged(first: f64, second: f64, darker: Darker, weight: f64) -> Judgement {
        Judgement {
            first: [first, 0.5],
            second: [second, 0.5],
            darker,
            weight,
        }
    }

    #[test]
    fn the_rate_is_the_weight_of_what_is_contradicted() {
        let judgements = [
            judged(0.1, 0.5, Darker::Neither, 1.0),
            judged(0.1, 0.9, Darker::First, 2.0),
            judged(0.1, 0.9, Darker::Second, 1.0),
            judged(0.9, 0.5, Darker::Second, 3.0),
            judged(0.9, 0.5, Darker::First, 0.0),
        ];
        let rate = whdr(EXTENT, STEPS, &judgements, 0.1).unwrap();
        assert!((rate - 1.0 / 7.0).abs() < 1e-12);
        let strict = whdr(EXTENT, STEPS, &judgements[..1], 0.01).unwrap();
        assert!((strict - 1.0).abs() < 1e-12);
    }

    #[test]
    fn points_outside_and_empty_lists_are_errors() {
        let outside = [judged(0.1, 1.1, Darker::First, 1.0)];
        let error = whdr(EXTENT, STEPS, &outside, 0.1).unwrap_err();
        assert!(error.to_string().contains("outside"), "{error}");
        let error = whdr(EXTENT, STEPS, &[], 0.1).unwrap_err();
        assert!(error.to_string().contains("no judgement"), "{error}");
        let edge = [judged(1.0, 0.0, Darker::Second, 1.0)];
        assert!(whdr(EXTENT, STEPS, &edge, 0.1).unwrap() < 1e-12);
    }
}
