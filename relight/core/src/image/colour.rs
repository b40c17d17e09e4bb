//! Colour images that know how their values are encoded.
//!
//! Everything inside is linear: only [`Rgb<Linear>`] can be rendered, added or measured. Files hold
//! [`Srgb`] values, or values to the power 1 / 2.2, and turning one into the other is always written out.

use std::fmt::Debug;
use std::marker::PhantomData;

use relit_data::srgb;
use serde::{Deserialize, Serialize};

use super::Planes;

/// How colour values stand for light: [`Linear`] or [`Srgb`].
pub trait ColourSpace: Copy + Debug + Send + Sync + 'static {
    /// The light that an encoded value stands for; 1 is white. Negative values are mirrored.
    fn to_linear(encoded: f32) -> f32;
    /// The value that stands for that much light.
    fn from_linear(light: f32) -> f32;
}

/// Values in proportion to light, without an upper bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Linear {}

/// Values encoded by the transfer function of sRGB (IEC 61966-2-1), 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Srgb {}

impl ColourSpace for Linear {
    fn to_linear(encoded: f32) -> f32 {
        encoded
    }

    fn from_linear(light: f32) -> f32 {
        light
    }
}

impl ColourSpace for Srgb {
    fn to_linear(encoded: f32) -> f32 {
        srgb::to_linear_f32(encoded)
    }

    fn from_linear(light: f32) -> f32 {
        srgb::from_linear_f32(light)
    }
}

/// How the integer values of a file are encoded, where that is known only at run time. Files of
/// floating point values (EXR, HDR) are always linear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Transfer {
    /// In proportion to light.
    Linear,
    /// As in [`Srgb`].
    Srgb,
    /// By the power 1 / 2.2: the paper's backgrounds.
    Gamma22,
}

/// An image of red, green and blue in the colour space `S`.
///
/// ```
/// use relight_core::image::{Extent, Linear, Planes, Rgb, Srgb};
///
/// let file = Rgb::<Srgb>::new(Planes::filled(Extent::new(2, 2), [0.5, 0.5, 1.0]));
/// let light: Rgb<Linear> = file.to_linear();
/// assert!((light.planes().pixel(0, 0)[0] - 0.214).abs() < 1e-3);
/// ```
///
/// An encoded image where a linear one is needed does not compile:
///
/// ```compile_fail
/// use relight_core::image::{Extent, Linear, Planes, Rgb, Srgb};
///
/// fn brightest(image: &Rgb<Linear>) -> f32 { image.planes().plane(0).iter().copied().fold(0.0, f32::max) }
/// brightest(&Rgb::<Srgb>::new(Planes::zeros(Extent::new(2, 2))));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Rgb<S> {
    planes: Planes<3>,
    space: PhantomData<S>,
}

impl<S: ColourSpace> Rgb<S> {
    /// The image whose values, encoded as `S` says, are these.
    pub const fn new(planes: Planes<3>) -> Self {
        Self {
            planes,
            space: PhantomData,
        }
    }

    /// The encoded values.
    pub const fn planes(&self) -> &Planes<3> {
        &self.planes
    }

    /// The encoded values, to write to.
    #[must_use]
    pub const fn planes_mut(&mut self) -> &mut Planes<3> {
        &mut self.planes
    }

    /// The encoded values themselves.
    pub fn into_planes(self) -> Planes<3> {
        self.planes
    }

    /// The same image in proportion to light.
    pub fn to_linear(self) -> Rgb<Linear> {
        Rgb::new(self.planes.map(S::to_linear))
    }
}

impl Rgb<Linear> {
    /// The same image, encoded for a file or a screen.
    pub fn encode<T: ColourSpace>(self) -> Rgb<T> {
        Rgb::new(self.planes.map(T::from_linear))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn comes_back<S: ColourSpace>() {
        for step in -20..=40 {
            let value = step as f32 / 20.0;
            let back = S::to_linear(S::from_linear(value));
            assert!((back - value).abs() < 2e-6, "{value} became {back}");
        }
    }

    #[test]
    fn encoding_and_decoding_cancel() {
        comes_back::<Linear>();
        comes_back::<Srgb>();
    }

    #[test]
    fn srgb_has_the_values_of_its_standard() {
        assert!((Srgb::to_linear(0.5) - 0.214_041).abs() < 1e-6);
        assert!((Srgb::to_linear(0.04) - 0.003_095_975).abs() < 1e-8);
        assert!((Srgb::from_linear(0.5) - 0.735_357).abs() < 1e-6);
    }
}
