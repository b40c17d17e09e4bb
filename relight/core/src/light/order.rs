//! How many bands an expansion in spherical harmonics has.

use super::LightError;

/// The highest band of an expansion in spherical harmonics, 0 to 64.
///
/// All orders that relight uses:
///
/// | constant | order | for |
/// | --- | --- | --- |
/// | [`Order::ZERO`] | 0 | even light |
/// | [`Order::TWO`] | 2 | the paper's: light that is estimated |
/// | [`Order::GLOSS`] | 6 | what the gloss of a turning object shows of its light |
/// | [`Order::LAMP`] | 8 | rooms with lamps around an object on a table |
/// | [`Order::HIGHLIGHT`] | 24 | panoramas and lamps that are given for a photograph: sharp enough for highlights |
/// | [`Order::RENDER`] | 48 | a panorama that lights given maps, by default |
/// | [`Order::HIGHEST`] | 64 | the highest that can be asked for |
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Order(u8);

impl Order {
    /// The highest order that can be asked for.
    pub const MAX: usize = 64;
    /// One coefficient: even light.
    pub const ZERO: Self = Self(0);
    /// Nine coefficients, as in the paper. Light is estimated to this order: of what a diffuse surface shows of a light,
    /// the bands above have 1 % of the energy in the mean over rooms and skies, and 6 % at worst under a sun. Light that
    /// is given keeps all of its bands.
    pub const TWO: Self = Self(2);
    /// What the gloss of a turning object shows of its light: a panorama or a mirror ball is read to this order.
    pub const GLOSS: Self = Self(6);
    /// A lamp that goes round an object in a video.
    pub const LAMP: Self = Self(8);
    /// Panoramas and lamps that are given for a photograph. A highlight of smoothness α weakens band l by about
    /// exp(-2 l² / α): where α is 200, the smoothest, 0.3 % of this band is left.
    pub const HIGHLIGHT: Self = Self(24);
    /// A panorama that lights given maps, whose smoothness may be any.
    pub const RENDER: Self = Self(48);
    /// The order that ends at [`Order::MAX`].
    pub const HIGHEST: Self = Self(Self::MAX as u8);

    /// The order with `highest` as its last band.
    ///
    /// # Errors
    /// Above [`Order::MAX`].
    pub fn new(highest: usize) -> Result<Self, LightError> {
        match u8::try_from(highest) {
            Ok(order) if highest <= Self::MAX => Ok(Self(order)),
            _ => Err(LightError::Coefficients(format!(
                "spherical harmonics of order {highest} are not supported: the highest order is {}",
                Self::MAX
            ))),
        }
    }

    /// The last band.
    pub const fn get(self) -> usize {
        self.0 as usize
    }

    /// How many coefficients there are: (order + 1)².
    pub const fn coefficients(self) -> usize {
        (self.get() + 1) * (self.get() + 1)
    }

    /// The order with so many coefficients.
    pub(super) fn from_coefficients(count: usize) -> Result<Self, LightError> {
        let side = count.isqrt();
        if count == 0 || side * side != count {
            return Err(LightError::Coefficients(format!(
                "{count} coefficients are not an order: give 1, 4, 9, 16, ..."
            )));
        }
        Self::new(side - 1)
    }
}
