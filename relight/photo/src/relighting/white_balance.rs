//! How the colour of new light is shown: as it is, as an eye that adapts to it sees it, or by a camera that is balanced for it.

use relight_core::image::Rgb;
use relight_core::light::{Panorama, ShLight};
use serde::{Deserialize, Serialize};

use super::{DiscLamp, InsertError, LightSource};

/// The most by which a channel is changed: light of one colour alone cannot become white.
const MAX_GAIN: f64 = 8.0;

/// How far an eye adapts to the colour of a lamp: D = F (1 - exp(-(L + 42) / 92) / 3.6) of CIECAM02 (Moroney et al. 2002), in dim
/// surroundings (F = 0.9) to which it is adapted at L = 20 cd/m².
const ADAPTATION: f64 = 0.7726;

/// How the colour of new light is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum WhiteBalance {
    /// The colour of a lamp or of coefficients as an eye sees it that adapts to it in part; a panorama, which is seen, as it is.
    #[default]
    Adapted,
    /// As the light has it.
    Light,
    /// As by a camera that is balanced for it: white is as grey in it as in the picture around the object.
    Auto,
}

impl WhiteBalance {
    /// What light is multiplied with, channel by channel: its mean stays, and with [`WhiteBalance::Auto`] it becomes grey. With
    /// [`WhiteBalance::Adapted`] it does so in part, after von Kries, as in CIECAM02: D mean / channel + 1 - D.
    pub fn tint(self, light: &ShLight) -> [f64; 3] {
        // The mean irradiance over all normals is that of band 0.
        let mean = light.coefficients().first().copied().unwrap_or([1.0; 3]);
        let grey = mean.iter().sum::<f64>() / 3.0;
        let degree = match self {
            Self::Adapted => ADAPTATION,
            Self::Light => 0.0,
            Self::Auto => 1.0,
        };
        if grey <= 0.0 {
            return [1.0; 3];
        }
        mean.map(|c| {
            let whole = (grey / c.max(grey / MAX_GAIN)).max(1.0 / MAX_GAIN);
            degree * whole + (1.0 - degree)
        })
    }

    /// Whether light is shown in the colours that it has.
    pub(crate) fn keeps(self, source: &LightSource) -> bool {
        match self {
            Self::Adapted => matches!(source, LightSource::Panorama(_)),
            Self::Light => true,
            Self::Auto => false,
        }
    }

    /// Light as it is shown.
    ///
    /// # Errors
    /// If the light is dark.
    pub fn shown(self, source: LightSource) -> Result<LightSource, InsertError> {
        if self.keeps(&source) {
            return Ok(source);
        }
        let tint = self.tint(&source.light()?);
        source.tinted(tint)
    }
}

impl LightSource {
    /// The light with each channel multiplied.
    ///
    /// # Errors
    /// None for light of finite values.
    pub(crate) fn tinted(self, tint: [f64; 3]) -> Result<Self, InsertError> {
        Ok(match self {
            Self::Panorama(panorama) => {
                let mut planes = panorama.image().planes().clone();
                for (plane, tint) in planes.planes_mut().into_iter().zip(tint) {
                    plane.iter_mut().for_each(|value| *value *= tint as f32);
                }
                Self::Panorama(Panorama::new(Rgb::new(planes))?)
            }
            Self::Lamp(lamp) => Self::Lamp(DiscLamp {
                colour: [0, 1, 2].map(|c| lamp.colour[c] * tint[c]),
                ..lamp
            }),
            Self::Coefficients(light) => Self::Coefficients(light.tinted(tint)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::image::Extent;
    use relight_core::light::Order;

    fn warm() -> LightSource {
        LightSource::Lamp("60,30,2700K".parse().unwrap())
    }

    fn mean(source: &LightSource) -> [f64; 3] {
        source.light().unwrap().coefficients()[0]
    }

    #[test]
    fn a_warm_lamp_is_shown_as_it_is_or_grey_and_as_strong() {
        let [r, _, b] = mean(&WhiteBalance::Light.shown(warm()).unwrap());
        assert!(r > 2.0 * b);
        let shown = mean(&WhiteBalance::Auto.shown(warm()).unwrap());
        let before: f64 = mean(&warm()).iter().sum();
        assert!((shown.iter().sum::<f64>() / before - 1.0).abs() < 1e-6);
        assert!((shown[0] / shown[2] - 1.0).abs() < 1e-6, "{shown:?}");
    }

    #[test]
    fn to_a_lamp_an_eye_adapts_in_part_and_a_panorama_is_shown_as_it_is() {
        let ratio = |balance: WhiteBalance| {
            let [r, _, b] = mean(&balance.shown(warm()).unwrap());
            r / b
        };
        let adapted = ratio(WhiteBalance::Adapted);
        assert!(adapted > 1.1 * ratio(WhiteBalance::Auto));
        assert!(adapted < 0.4 * ratio(WhiteBalance::Light), "{adapted}");
        let blue = ShLight::even(Order::TWO, [0.2, 0.4, 1.0]);
        let sky = LightSource::Panorama(Panorama::from_light(&blue, Extent::new(32, 16)));
        assert_eq!(WhiteBalance::default().shown(sky.clone()).unwrap(), sky);
    }

    #[test]
    fn a_panorama_and_coefficients_are_balanced_too_and_one_colour_alone_does_not_become_white() {
        let blue = ShLight::even(Order::TWO, [0.2, 0.4, 1.0]);
        let panorama = Panorama::from_light(&blue, Extent::new(32, 16));
        for source in [
            LightSource::Panorama(panorama),
            LightSource::Coefficients(blue),
        ] {
            let [r, g, b] = mean(&WhiteBalance::Auto.shown(source).unwrap());
            assert!((r / b - 1.0).abs() < 1e-3 && (g / b - 1.0).abs() < 1e-3);
        }
        let red = ShLight::even(Order::TWO, [1.0, 0.0, 0.0]);
        let tint = WhiteBalance::Auto.tint(&red);
        assert!(tint.iter().all(|t| t.is_finite() && *t <= MAX_GAIN));
        assert_eq!(
            WhiteBalance::Auto.tint(&ShLight::dark(Order::TWO)),
            [1.0; 3]
        );
    }
}
