//! What metal shows of the environment light.

use relight_core::light::LightError;

use crate::model::gloss::{GLOSS_TERMS, GlossLight, terms_of};
use crate::model::harmonics::HarmonicTerm;
use crate::model::lighting::{OF_COEFFICIENTS, TableLight};

/// What white metal shows of a light, over the sum of its terms times the light's coefficients: as bright as a
/// Lambertian white surface in even light, π times it, and the terms are √(4π) times the harmonics.
pub(crate) const MIRROR: f64 = 0.886_226_925_452_758;

/// The same where all light is reflected.
pub(crate) fn mirror_terms(reflected: [f64; 3]) -> [HarmonicTerm; GLOSS_TERMS] {
    terms_of(1.0, reflected)
}

impl TableLight {
    /// The light of which a mirror shows this.
    ///
    /// # Errors
    /// Where a term is not finite.
    pub(crate) fn of_mirror(shown: &GlossLight) -> Result<Self, LightError> {
        let light = shown.light()?;
        let coefficients = light.coefficients();
        let factor = |channel: usize| {
            OF_COEFFICIENTS.map(|(at, factor)| factor * coefficients[at][channel] / MIRROR)
        };
        Ok(Self::new([0, 1, 2].map(factor)))
    }
}
