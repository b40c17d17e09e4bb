//! Angles between normals.

use super::{Comparison, MetricError};
use crate::image::Extent;

/// Angles between true and estimated normals, degrees, over the pixels under a mask.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngularError {
    /// Their mean.
    pub mean: f64,
    /// Their median; of an even number the lower of the two in the middle.
    pub median: f64,
    /// The fraction of pixels, 0..=1, with an angle of at most [`AngularError::LIMITS`].
    pub within: [f64; 3],
}

impl AngularError {
    /// The limits of [`AngularError::within`] that are in use, degrees.
    pub const LIMITS: [f64; 3] = [11.25, 22.5, 30.0];
}

/// The angles between two normal maps, whose planes are x, y and z in the same axes. The
/// vectors need not be of length 1.
///
/// # Errors
/// As [`Comparison::new`]; [`MetricError::Incomparable`] if a vector under the mask has no length.
pub fn angular_error(
    extent: Extent,
    truth: [&[f32]; 3],
    estimate: [&[f32]; 3],
    mask: &[bool],
) -> Result<AngularError, MetricError> {
    Comparison::new(extent, &truth, &estimate, mask)?;
    let mut angles = Vec::new();
    for (at, _) in mask.iter().enumerate().filter(|(_, counts)| **counts) {
        let vector = |what, planes: [&[f32]; 3]| {
            let vector = planes.map(|plane| f64::from(plane[at]));
            let (x, y) = (at % extent.width, at / extent.width);
            if vector == [0.0; 3] {
                return Err(MetricError::Incomparable(format!(
                    "{what} has a normal of length zero at pixel ({x}, {y})"
                )));
            }
            Ok(vector)
        };
        let pair = (
            vector("the ground truth", truth)?,
            vector("the estimate", estimate)?,
        );
        angles.push(angle(pair.0, pair.1).to_degrees());
    }
    angles.sort_unstable_by(f64::total_cmp);
    Ok(summary(&angles))
}

fn summary(sorted: &[f64]) -> AngularError {
    let count = sorted.len() as f64;
    let within = AngularError::LIMITS
        .map(|limit| sorted.partition_point(|&angle| angle <= limit) as f64 / count);
    AngularError {
        mean: sorted.iter().sum::<f64>() / count,
        median: sorted
            .get((sorted.len() - 1) / 2)
            .copied()
            .unwrap_or_default(),
        within,
    }
}

/// The angle between two vectors, radians, 0..=pi. By the arc tangent, which keeps small angles
/// exact where the arc cosine does not.
pub fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let cross = [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ];
    let dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    cross
        .iter()
        .map(|value| value * value)
        .sum::<f64>()
        .sqrt()
        .atan2(dot)
}
