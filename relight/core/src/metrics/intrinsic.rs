//! SMSE and LMSE of albedo and shading, by the two conventions in which they are published.

use super::{Comparison, MetricError, ScaleFit, Windows};
use crate::image::Extent;

/// The quantity that SMSE or LMSE measures: published tables use both, often without stating which.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Convention {
    /// Grey images (the mean of the channels), the ground truth scaled to a maximum of 1 under the mask,
    /// one scale an image.
    Strict,
    /// The values of the files as they are, 0..=1, one scale a colour channel; the mean over
    /// channels. What released code of this line of work computes.
    FileUnits,
}

impl Convention {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Strict, Self::FileUnits];

    /// Which scales it fits.
    pub const fn fit(self) -> ScaleFit {
        match self {
            Self::Strict => ScaleFit::Image,
            Self::FileUnits => ScaleFit::Channel,
        }
    }
}

/// SMSE and LMSE of one image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IntrinsicError {
    /// Scale-invariant MSE: the mean over pixels under the mask.
    pub smse: f64,
    /// Local MSE over [`Windows`], in relation to the ground truth's energy.
    pub lmse: f64,
}

/// SMSE and LMSE of an albedo or shading by a convention. The planes are those of [`Comparison`]; an
/// estimate of one plane stands for each channel of the ground truth.
///
/// # Errors
/// As [`Comparison::new`] and [`Comparison::lmse`]; [`MetricError::DarkGroundTruth`] if the ground truth has
/// no positive value to be scaled by.
pub fn intrinsic_error(
    convention: Convention,
    extent: Extent,
    truth: &[&[f32]],
    estimate: &[&[f32]],
    mask: &[bool],
    windows: Windows,
) -> Result<IntrinsicError, MetricError> {
    let spread = match estimate {
        &[one] => vec![one; truth.len()],
        planes => planes.to_vec(),
    };
    // It checks the planes as they are, before they are turned into others.
    let pair = Comparison::new(extent, truth, &spread, mask)?;
    match convention {
        Convention::FileUnits => measure(&pair, convention.fit(), windows),
        Convention::Strict => {
            let truth = to_maximum_one(grey(truth), mask)?;
            let estimate = grey(&spread);
            let pair = Comparison::new(extent, &[&truth], &[&estimate], mask)?;
            measure(&pair, convention.fit(), windows)
        }
    }
}

fn measure(
    pair: &Comparison<'_>,
    fit: ScaleFit,
    windows: Windows,
) -> Result<IntrinsicError, MetricError> {
    Ok(IntrinsicError {
        smse: pair.mse(fit),
        lmse: pair.lmse(fit, windows)?,
    })
}

/// The mean of the channels at each pixel.
fn grey(planes: &[&[f32]]) -> Vec<f32> {
    let pixels = planes.first().map_or(0, |plane| plane.len());
    let sum = |at: usize| -> f64 { planes.iter().map(|plane| f64::from(plane[at])).sum() };
    (0..pixels)
        .map(|at| (sum(at) / planes.len() as f64) as f32)
        .collect()
}

fn to_maximum_one(mut plane: Vec<f32>, mask: &[bool]) -> Result<Vec<f32>, MetricError> {
    let under_mask = plane.iter().zip(mask).filter(|(_, counts)| **counts);
    let maximum = under_mask.fold(0.0_f32, |most, (&value, _)| most.max(value));
    if maximum <= 0.0 {
        return Err(MetricError::DarkGroundTruth);
    }
    for value in &mut plane {
        *value /= maximum;
    }
    Ok(plane)
}
