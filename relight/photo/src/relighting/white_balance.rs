//! How the colour of new light is shown: as it is, or by a camera that is balanced for it.

use relight_core::image::{Linear, Rgb};
use relight_core::light::{Panorama, ShLight};
use serde::{Deserialize, Serialize};

use super::{DiscLamp, InsertError, LightSource};

/// The most by which a channel is changed: light of one colour alone cannot become white.
const MAX_GAIN: f64 = 8.0;

/// How the colour of new light is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum WhiteBalance {
    /// As the light has it.
    #[default]
    Light,
    /// As by a camera that is balanced for it: white is as grey in it as in the picture around the object.
    Auto,
}

impl WhiteBalance {
    /// What light is multiplied with, channel by channel: its mean stays, and with [`WhiteBalance::Auto`] it becomes grey.
    #[must_use]
    pub fn tint(self, light: &ShLight) -> [f64; 3] {
        // The mean irradiance over all normals is that of band 0.
        let mean = light.coefficients().first().copied().unwrap_or([1.0; 3]);
        let grey = mean.iter().sum::<f64>() / 3.0;
        match self {
            Self::Auto if grey > 0.0 => {
                mean.map(|c| (grey / c.max(grey / MAX_GAIN)).max(1.0 / MAX_GAIN))
            }
            _ => [1.0; 3],
        }
    }

    /// Light as it is shown.
    ///
    /// # Errors
    /// If the light is dark.
    pub fn shown(self, source: LightSource) -> Result<LightSource, InsertError> {
        if self == Self::Light {
            return Ok(source);
        }
        let tint = self.tint(&source.light()?);
        Ok(match source {
            LightSource::Panorama(panorama) => {
                let planes = panorama.image().planes().clone();
                let tinted = tinted(Rgb::new(planes), tint.map(|t| t as f32));
                LightSource::Panorama(Panorama::new(tinted)?)
            }
            LightSource::Lamp(lamp) => LightSource::Lamp(DiscLamp {
                colour: [0, 1, 2].map(|c| lamp.colour[c] * tint[c]),
                ..lamp
            }),
            LightSource::Coefficients(light) => LightSource::Coefficients(light.tinted(tint)),
        })
    }
}

/// A picture whose channels are multiplied.
pub(crate) fn tinted(mut picture: Rgb<Linear>, tint: [f32; 3]) -> Rgb<Linear> {
    let planes = picture.planes_mut().planes_mut();
    for (plane, tint) in planes.into_iter().zip(tint) {
        plane.iter_mut().for_each(|value| *value *= tint);
    }
    picture
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
