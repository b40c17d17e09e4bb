//! Errors of light.

/// An error of light.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LightError {
    /// The numbers are not the coefficients of any order.
    #[error("{0}")]
    Coefficients(String),
    /// A value is infinite or not a number.
    #[error("the light has a value that is infinite or not a number")]
    NotFinite,
    /// There are too few pixels for a fit.
    #[error("there are too few pixels to fit the light's coefficients")]
    TooFewPixels,
    /// The panorama has no pixels.
    #[error("the panorama has no pixels")]
    Empty,
}
