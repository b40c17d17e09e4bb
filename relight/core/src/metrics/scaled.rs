//! Squared error after the best scale: over the image, and over windows of it.

use super::comparison::Channel;
use super::{Comparison, MetricError};
use crate::image::Extent;

/// The scales that are fitted to the estimate before the comparison, by least squares under the mask.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScaleFit {
    /// None: the values are compared as they are.
    None,
    /// One for all channels.
    Image,
    /// One for each channel.
    Channel,
}

impl ScaleFit {
    /// How a table names it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Image => "one an image",
            Self::Channel => "one a channel",
        }
    }
}

/// The windows of LMSE: squares that lie wholly inside the image, the first at its upper left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Windows {
    /// Side of a window, pixels, at least 1.
    pub side: usize,
    /// From one window to the next, right and down, pixels, at least 1.
    pub step: usize,
}

impl Windows {
    /// Windows of 20 pixels, half overlapping, for images whose longer side has about 320 pixels.
    pub const GROSSE: Self = Self { side: 20, step: 10 };
}

/// Sums from which scale and error of a channel follow.
#[derive(Debug, Clone, Copy, Default)]
struct SufficientStatistics {
    truth_truth: f64,
    truth_estimate: f64,
    estimate_estimate: f64,
}

impl SufficientStatistics {
    fn from_pairs(pairs: impl Iterator<Item = (f64, f64)>) -> Self {
        let mut statistics = Self::default();
        for (truth, estimate) in pairs {
            statistics.truth_truth += truth * truth;
            statistics.truth_estimate += truth * estimate;
            statistics.estimate_estimate += estimate * estimate;
        }
        statistics
    }

    fn plus(self, other: Self) -> Self {
        Self {
            truth_truth: self.truth_truth + other.truth_truth,
            truth_estimate: self.truth_estimate + other.truth_estimate,
            estimate_estimate: self.estimate_estimate + other.estimate_estimate,
        }
    }

    /// The scale that brings the estimate nearest to the ground truth; 0 where the estimate is 0.
    fn scale(self) -> f64 {
        if self.estimate_estimate > 0.0 {
            self.truth_estimate / self.estimate_estimate
        } else {
            0.0
        }
    }
}

impl Comparison<'_> {
    /// Mean over pixels and channels of the squared difference, after the best scale. With
    /// [`ScaleFit::None`] it is MSE, otherwise the scale-invariant MSE of Grosse et al. (2009),
    /// min over s of |truth - s estimate|^2 / n. A best scale may be negative; it is 0 for an
    /// estimate that is 0 everywhere.
    ///
    /// Squared units of the ground truth.
    pub fn mse(&self, fit: ScaleFit) -> f64 {
        let statistics: Vec<SufficientStatistics> = self
            .channels
            .iter()
            .map(|channel| SufficientStatistics::from_pairs(channel.under(self.mask)))
            .collect();
        let channels = self.channels.iter().zip(best_scales(fit, &statistics));
        let sum: f64 = channels
            .map(|(channel, scale)| squared_error(channel.under(self.mask), scale))
            .sum();
        sum / (self.count() * self.channels.len()) as f64
    }

    /// The local error of Grosse et al. (2009): squared error after the best scale of each window,
    /// summed over all windows, in relation to the energy of the ground truth, summed over the same
    /// windows. 0 for an estimate that is right up to a scale in each window, 1 for one that is 0
    /// (and, unless no scale is fitted, never more).
    ///
    /// With [`ScaleFit::Channel`] it is the mean of the channels' own local errors; otherwise the
    /// sums go over all channels. Published scripts take an estimate with an energy of less than
    /// 1e-5 in a window as 0; that is left out here, as it makes the measure depend on the
    /// estimate's units.
    ///
    /// # Errors
    /// [`MetricError::Incomparable`] if no window fits, [`MetricError::DarkGroundTruth`] if the ground truth is 0 in all windows.
    pub fn lmse(&self, fit: ScaleFit, windows: Windows) -> Result<f64, MetricError> {
        windows.check(self.extent)?;
        let mut totals = vec![Total::default(); self.channels.len()];
        for (x, y) in windows.corners(self.extent) {
            self.add_window(fit, (x, y), windows.side, &mut totals);
        }
        if fit == ScaleFit::Channel {
            let sum: f64 = totals
                .iter()
                .map(|total| total.ratio())
                .sum::<Result<_, _>>()?;
            return Ok(sum / totals.len() as f64);
        }
        let sum = totals.iter().fold(Total::default(), |sum, total| Total {
            error: sum.error + total.error,
            energy: sum.energy + total.energy,
        });
        sum.ratio()
    }

    /// Adds a window's squared error and energy to the totals of the channels.
    fn add_window(&self, fit: ScaleFit, corner: (usize, usize), side: usize, totals: &mut [Total]) {
        let statistics: Vec<SufficientStatistics> = self
            .channels
            .iter()
            .map(|&channel| SufficientStatistics::from_pairs(self.window(channel, corner, side)))
            .collect();
        let scales = best_scales(fit, &statistics);
        for (((total, &channel), statistics), scale) in totals
            .iter_mut()
            .zip(&self.channels)
            .zip(&statistics)
            .zip(scales)
        {
            total.error += squared_error(self.window(channel, corner, side), scale);
            total.energy += statistics.truth_truth;
        }
    }

    /// Ground truth and estimate of the pixels of a window that count.
    fn window<'a>(
        &'a self,
        channel: Channel<'a>,
        (left, top): (usize, usize),
        side: usize,
    ) -> impl Iterator<Item = (f64, f64)> {
        (top..top + side).flat_map(move |y| {
            let first = y * self.extent.width + left;
            let row = first..first + side;
            let part = Channel {
                truth: &channel.truth[row.clone()],
                estimate: &channel.estimate[row.clone()],
            };
            part.under(&self.mask[row])
        })
    }
}

impl Windows {
    fn check(self, Extent { width, height }: Extent) -> Result<(), MetricError> {
        if self.side > width.min(height) {
            return Err(too_small(width, height, self.side));
        }
        Ok(())
    }

    /// The upper left corners of the windows that lie wholly inside the image.
    fn corners(self, extent: Extent) -> impl Iterator<Item = (usize, usize)> {
        let starts = move |length: usize| (0..=length - self.side).step_by(self.step);
        starts(extent.height).flat_map(move |y| starts(extent.width).map(move |x| (x, y)))
    }
}

/// Why no window of this side fits.
pub(super) fn too_small(width: usize, height: usize, window: usize) -> MetricError {
    MetricError::Incomparable(format!(
        "an image of {width}x{height} pixels holds no window of {window}x{window}"
    ))
}

/// Squared error and energy of the ground truth, over windows.
#[derive(Debug, Clone, Copy, Default)]
struct Total {
    error: f64,
    energy: f64,
}

impl Total {
    fn ratio(self) -> Result<f64, MetricError> {
        if self.energy > 0.0 {
            Ok(self.error / self.energy)
        } else {
            Err(MetricError::DarkGroundTruth)
        }
    }
}

/// The scale of each channel.
fn best_scales(fit: ScaleFit, statistics: &[SufficientStatistics]) -> Vec<f64> {
    match fit {
        ScaleFit::None => vec![1.0; statistics.len()],
        ScaleFit::Channel => statistics.iter().map(|channel| channel.scale()).collect(),
        ScaleFit::Image => {
            let all = statistics
                .iter()
                .fold(SufficientStatistics::default(), |sum, &channel| {
                    sum.plus(channel)
                });
            vec![all.scale(); statistics.len()]
        }
    }
}

fn squared_error(pairs: impl Iterator<Item = (f64, f64)>, scale: f64) -> f64 {
    pairs
        .map(|(truth, estimate)| (truth - scale * estimate).powi(2))
        .sum()
}
