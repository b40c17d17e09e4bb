//! Why something cannot be measured.

/// Why something cannot be measured.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MetricError {
    /// The images, or the settings of the comparison, do not fit.
    #[error("{0}")]
    Incomparable(String),
    /// No pixel counts.
    #[error("the mask is empty: nothing to compare")]
    EmptyMask,
    /// The ground truth is zero wherever it counts.
    #[error("the ground truth is zero at every compared pixel: the relative error is undefined")]
    DarkGroundTruth,
}
