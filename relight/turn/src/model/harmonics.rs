//! The curve of a pixel over the table's angle as a Fourier series.

use relight_core::light::Order;

/// The order of the light that gloss is taken to show.
pub(crate) const GLOSS_ORDER: usize = Order::GLOSS.get();

/// Harmonics that are fitted to a curve: gloss has more than a Lambertian surface.
pub(crate) const HARMONICS: usize = GLOSS_ORDER;

/// Terms of a curve: a constant, and two of each harmonic.
pub(crate) const COEFFICIENTS: usize = 2 * HARMONICS + 1;

/// Harmonics of the table's angle in the curve of a Lambertian pixel.
const LAMBERTIAN_HARMONICS: usize = 2;

/// Terms of a Lambertian pixel's curve, the first of them.
pub(crate) const LAMBERTIAN_COEFFICIENTS: usize = 2 * LAMBERTIAN_HARMONICS + 1;

/// What a term of the light contributes to a curve: these values to two Fourier coefficients, the first of them
/// `coefficient`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct HarmonicTerm {
    pub(crate) coefficient: usize,
    pub(crate) parts: [f64; 2],
}
