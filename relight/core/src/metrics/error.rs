//! Why something cannot be measured.

/// Why something cannot be measured.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MetricError {
    /// The images, or what is said of them, cannot be compared.
    #[error("{0}")]
    Incomparable(String),
    /// No pixel counts.
    #[error("no pixel is to be compared: the mask is empty")]
    EmptyMask,
    /// The ground truth is zero wherever it counts.
    #[error(
        "the ground truth is zero at every pixel that counts: no error in relation to it can be given"
    )]
    DarkGroundTruth,
}
