//! The curve of a pixel over the table's angle as a Fourier series.

/// The order of the light that gloss is taken to show.
pub(crate) const GLOSS_ORDER: usize = 6;

/// Harmonics that are fitted to a curve: gloss has more than a matt surface.
pub(crate) const HARMONICS: usize = GLOSS_ORDER;

/// Terms of a curve: a constant, and two of each harmonic.
pub(crate) const WAVES: usize = 2 * HARMONICS + 1;

/// Harmonics of the table's angle in the curve of a matt pixel.
const MATT_HARMONICS: usize = 2;

/// Terms of a matt pixel's curve, the first of them.
pub(crate) const MATT_WAVES: usize = 2 * MATT_HARMONICS + 1;

/// What a term of the light contributes to a curve: these values to two waves, the first of them `wave`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WaveTerm {
    pub(crate) wave: usize,
    pub(crate) parts: [f64; 2],
}

/// The values of the waves at an angle of the table, radians.
pub(crate) fn basis_at(angle: f64) -> [f64; WAVES] {
    let mut basis = [1.0; WAVES];
    for harmonic in 1..=HARMONICS {
        let (sin, cos) = (harmonic as f64 * angle).sin_cos();
        basis[2 * harmonic - 1] = cos;
        basis[2 * harmonic] = -sin;
    }
    basis
}
