//! Structural similarity.

use super::comparison::Channel;
use super::scaled::too_small;
use super::{Comparison, MetricError};
use crate::image::Extent;

const K1: f64 = 0.01;
const K2: f64 = 0.03;

/// The windows over which SSIM takes its means and variances, as a table names them: those of the publication, and of
/// scikit-image with `gaussian_weights=True, sigma=1.5, use_sample_covariance=False`.
pub const SSIM_WINDOW: &str = "gaussian 11x11, sigma 1.5";

/// The weights along one side of a window; their sum is 1.
fn weights() -> Vec<f64> {
    let raw: Vec<f64> = (-5..=5)
        .map(|x: i32| (-0.5 * (f64::from(x) / 1.5).powi(2)).exp())
        .collect();
    let sum: f64 = raw.iter().sum();
    raw.into_iter().map(|weight| weight / sum).collect()
}

/// The dissimilarity that belongs to an SSIM: (1 - SSIM) / 2, 0..=1.
pub fn dssim(ssim: f64) -> f64 {
    (1.0 - ssim) / 2.0
}

impl Comparison<'_> {
    /// The mean structural similarity, -1..=1, 1 for equal images; of several channels their mean.
    /// Values are of 0..=1.
    ///
    /// Pixels outside the mask are 0 in both images; the mean goes over the windows that lie wholly
    /// inside the image and have their middle under the mask.
    ///
    /// # Errors
    /// [`MetricError::Incomparable`] if no window fits, or none has its middle under the mask.
    pub fn ssim(&self) -> Result<f64, MetricError> {
        let weights = weights();
        let window = weights.len();
        let Extent { width, height } = self.extent;
        if window > width.min(height) {
            return Err(too_small(width, height, window));
        }
        let middles = self.middles(window);
        if middles.is_empty() {
            return Err(MetricError::Incomparable(format!(
                "no window of {window}x{window} pixels has its centre in the mask"
            )));
        }
        let similarity = |channel: &Channel<'_>| {
            let moments = self.local_moments(*channel, &weights);
            middles
                .iter()
                .map(|&at| moments.similarity(at))
                .sum::<f64>()
                / middles.len() as f64
        };
        let sum: f64 = self.channels.iter().map(similarity).sum();
        Ok(sum / self.channels.len() as f64)
    }

    /// Which of the windows that fit, row by row, have their middle under the mask.
    fn middles(&self, window: usize) -> Vec<usize> {
        let (edge, width) = (window / 2, self.extent.width);
        let rows = self
            .mask
            .chunks_exact(width)
            .skip(edge)
            .take(self.extent.height + 1 - window);
        rows.flat_map(|row| &row[edge..width - edge])
            .enumerate()
            .filter_map(|(at, &counts)| counts.then_some(at))
            .collect()
    }

    fn local_moments(&self, channel: Channel<'_>, weights: &[f64]) -> LocalMoments {
        let masked = |plane: &[f32]| -> Vec<f64> {
            let pixels = plane.iter().zip(self.mask);
            let value = |(&value, &counts)| if counts { f64::from(value) } else { 0.0 };
            pixels.map(value).collect()
        };
        let (truth, estimate) = (masked(channel.truth), masked(channel.estimate));
        let product =
            |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a * b).collect() };
        let mean = |plane: &[f64]| filter(plane, self.extent.width, weights);
        LocalMoments {
            truth_truth: mean(&product(&truth, &truth)),
            truth_estimate: mean(&product(&truth, &estimate)),
            estimate_estimate: mean(&product(&estimate, &estimate)),
            truth: mean(&truth),
            estimate: mean(&estimate),
        }
    }
}

/// Weighted means over each window.
struct LocalMoments {
    truth: Vec<f64>,
    estimate: Vec<f64>,
    truth_truth: Vec<f64>,
    truth_estimate: Vec<f64>,
    estimate_estimate: Vec<f64>,
}

impl LocalMoments {
    fn similarity(&self, at: usize) -> f64 {
        let (a, b) = (self.truth[at], self.estimate[at]);
        let variance_a = self.truth_truth[at] - a * a;
        let variance_b = self.estimate_estimate[at] - b * b;
        let covariance = self.truth_estimate[at] - a * b;
        let (c1, c2) = (K1.powi(2), K2.powi(2));
        ((2.0 * a * b + c1) * (2.0 * covariance + c2))
            / ((a * a + b * b + c1) * (variance_a + variance_b + c2))
    }
}

/// The plane filtered along rows and columns, where the whole window fits.
fn filter(plane: &[f64], width: usize, weights: &[f64]) -> Vec<f64> {
    let narrow = width + 1 - weights.len();
    let weighted = |window: &[f64]| -> f64 {
        window
            .iter()
            .zip(weights)
            .map(|(value, weight)| value * weight)
            .sum()
    };
    let along_rows: Vec<f64> = plane
        .chunks_exact(width)
        .flat_map(|row| row.windows(weights.len()).map(weighted))
        .collect();
    let rows: Vec<&[f64]> = along_rows.chunks_exact(narrow).collect();
    rows.windows(weights.len())
        .flat_map(|rows| {
            let mut sums = vec![0.0; narrow];
            for (row, weight) in rows.iter().zip(weights) {
                for (sum, value) in sums.iter_mut().zip(*row) {
                    *sum += weight * value;
                }
            }
            sums
        })
        .collect()
}
