//! Why something cannot be measured.

/// Why something cannot be measured.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MetricError {
    /// A plane does not have one value a pixel.
    #[error(
        "{what} has {found} values where {expected} pixels are compared: the images are not of one size"
    )]
    Length {
        /// Which image.
        what: &'static str,
        /// How many values a plane of it has.
        found: usize,
        /// How many pixels there are.
        expected: usize,
    },
    /// The images do not have the same channels.
    #[error(
        "the ground truth has {truth} channels and the estimate {estimate}: they cannot be compared"
    )]
    Channels {
        /// Channels of the ground truth.
        truth: usize,
        /// Channels of the estimate.
        estimate: usize,
    },
    /// No pixel counts.
    #[error("no pixel is to be compared: the mask is empty")]
    EmptyMask,
    /// Pixels count only where no window fits around them.
    #[error("no window of {window}x{window} pixels has its middle under the mask")]
    NoWindow {
        /// The window's side.
        window: usize,
    },
    /// A value under the mask is infinite or not a number.
    #[error("{what} has the value {value} at pixel ({x}, {y}): only finite values can be compared")]
    NotFinite {
        /// Which image.
        what: &'static str,
        /// The value.
        value: f32,
        /// The pixel's column.
        x: usize,
        /// The pixel's row.
        y: usize,
    },
    /// A window does not fit into the image.
    #[error("an image of {width}x{height} pixels holds no window of {window}x{window}")]
    TooSmall {
        /// The image's width.
        width: usize,
        /// The image's height.
        height: usize,
        /// The window's side.
        window: usize,
    },
    /// The ground truth is zero wherever it counts.
    #[error(
        "the ground truth is zero at every pixel that counts: no error in relation to it can be given"
    )]
    DarkGroundTruth,
    /// A vector that should be a direction has no length.
    #[error("{what} has a normal of length zero at pixel ({x}, {y})")]
    ZeroNormal {
        /// Which map.
        what: &'static str,
        /// The pixel's column.
        x: usize,
        /// The pixel's row.
        y: usize,
    },
    /// A setting that makes no sense.
    #[error("{what} is {value}, it must be {must}")]
    Setting {
        /// Which setting.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        must: &'static str,
    },
    /// A judgement about a point outside the image.
    #[error("a judgement names the point ({x}, {y}), which is outside an image of 1x1")]
    OutsidePoint {
        /// Its horizontal place, 0..=1.
        x: f64,
        /// Its vertical place, 0..=1.
        y: f64,
    },
    /// There are no judgements that count.
    #[error("no judgement has a positive weight: there is nothing to agree with")]
    NoJudgements,
}
