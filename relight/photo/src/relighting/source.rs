//! Where new light comes from.

use super::{DiscLamp, InsertError};
use relight_core::image::Extent;
use relight_core::light::{Order, Panorama, ShLight};
use relight_core::render::{DiffuseForm, DiffuseLayer, exposure_for};

/// The size of the panorama of a lamp or coefficients for casting shadows.
const DRAWN: Extent = Extent::new(256, 128);

/// New light.
#[derive(Debug, Clone, PartialEq)]
pub enum LightSource {
    /// All around.
    Panorama(Panorama),
    /// One lamp and even light.
    Lamp(DiscLamp),
    /// Coefficients of spherical harmonics.
    Coefficients(ShLight),
}

impl LightSource {
    /// The light as coefficients: all given ones, or enough for highlights.
    ///
    /// # Errors
    /// If no surface receives any of it.
    pub fn light(&self) -> Result<ShLight, InsertError> {
        let light = match self {
            Self::Panorama(panorama) => panorama.project(Order::HIGHLIGHT),
            Self::Lamp(lamp) => lamp.light(Order::HIGHLIGHT),
            Self::Coefficients(light) => light.with_order(light.order().max(Order::TWO)),
        };
        // An exposure is 1 for light that reaches nothing.
        let is_dark = light.coefficients().iter().flatten().all(|&c| c == 0.0);
        if is_dark || brightest(&light) <= 0.0 {
            let fault = "the light is completely dark: give another light";
            return Err(InsertError::Input(fault.to_owned()));
        }
        Ok(light)
    }

    /// The light as a panorama. Negative radiance, which coefficients can stand for, is none.
    pub fn panorama(&self) -> Panorama {
        match self {
            Self::Panorama(panorama) => panorama.clone(),
            Self::Lamp(lamp) => lamp.panorama(DRAWN),
            Self::Coefficients(light) => Panorama::from_light(light, DRAWN),
        }
    }
}

/// The irradiance on a surface that faces the strongest light.
fn brightest(light: &ShLight) -> f32 {
    let top = DiffuseLayer::new(light, DiffuseForm::Irradiance)
        .shading(&relight_core::light::Normals::sphere(16));
    let most = top
        .planes()
        .planes()
        .into_iter()
        .flatten()
        .fold(0.0_f32, |a, &b| a.max(b));
    // From behind, the sphere that is seen may be dark.
    most.max(1.0 / exposure_for(light))
}

/// What new light has to be multiplied with, so that a surface that faces the strongest of it is as bright as one in
/// the old light. It does not change when light turns, and is exactly 1 for the same light.
pub fn exposure_between(old: &ShLight, new: &ShLight) -> f32 {
    exposure_for(new) / exposure_for(old)
}

/// How much two lights come from the same side, 0 to 1: 1 for lights of one shape, whatever their strength and
/// colour, 0 for opposite ones. It is the part of the shadows in the one that hold in the other.
///
/// With a and b the irradiance of bands 1 and 2, each over that of band 0, it is `1 - |a - b| / (|a| + |b|)`.
pub(super) fn likeness(old: &ShLight, new: &ShLight) -> f64 {
    let [a, b] = [old, new].map(directed);
    let length = |v: [f64; 8]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    let apart = length([0, 1, 2, 3, 4, 5, 6, 7].map(|k| a[k] - b[k]));
    let all = length(a) + length(b);
    // Two lights that are nearly even are alike.
    1.0 - apart / (all + NEARLY_EVEN)
}

/// How much of a light comes from one side, 0 to 1: 1 for a lamp with hardly any light from elsewhere, 0 for most rooms.
pub(crate) fn directedness(light: &ShLight) -> f32 {
    let length = directed(light).iter().map(|c| c * c).sum::<f64>().sqrt();
    let (room, lamp) = ROOM_AND_LAMP;
    let part = ((length - room) / (lamp - room)).clamp(0.0, 1.0);
    (part * part * (3.0 - 2.0 * part)) as f32
}

/// The irradiance of bands 1 and 2 over that of band 0 of light that comes from one side as it does in a room, and of a lamp's with
/// the even light of [`DiscLamp::default`].
const ROOM_AND_LAMP: (f64, f64) = (0.35, 0.7);
/// Directed light below this part of the even light hardly makes a shadow.
const NEARLY_EVEN: f64 = 0.05;

/// Grey irradiance of bands 1 and 2 over that of band 0.
fn directed(light: &ShLight) -> [f64; 8] {
    let grey = |at: usize| {
        light
            .coefficients()
            .get(at)
            .map_or(0.0, |c| c.iter().sum::<f64>())
    };
    let even = grey(0).abs().max(f64::MIN_POSITIVE);
    [1, 2, 3, 4, 5, 6, 7, 8].map(|at: usize| {
        let lobe = if at < 4 { 2.0 / 3.0 } else { 0.25 };
        (lobe * grey(at) / even).clamp(-1e3, 1e3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::light::{Direction, Rotation};

    fn lamp(azimuth: f64) -> ShLight {
        DiscLamp {
            azimuth,
            ..DiscLamp::default()
        }
        .light(Order::TWO)
    }

    #[test]
    fn light_is_like_itself_in_any_strength_and_unlike_what_comes_from_the_other_side() {
        assert!((likeness(&lamp(30.0), &lamp(30.0).tinted([3.0; 3])) - 1.0).abs() < 1e-12);
        let turned = |degrees| likeness(&lamp(0.0), &lamp(degrees));
        assert!(turned(20.0) > turned(60.0) && turned(60.0) > turned(180.0));
        assert!(turned(180.0) < 0.4);
        let even = ShLight::even(Order::TWO, [1.0; 3]);
        assert!((likeness(&even, &even.clone().tinted([0.1; 3])) - 1.0).abs() < 1e-9);
        assert!(likeness(&even, &lamp(0.0)) < 0.2);
    }

    #[test]
    fn the_exposure_is_that_of_the_strongest_light_and_does_not_change_as_light_turns() {
        let bright = lamp(10.0).tinted([4.0; 3]);
        assert_eq!(exposure_between(&bright, &bright), 1.0);
        assert!((exposure_between(&lamp(10.0), &bright) - 0.25).abs() < 1e-6);
        let turned = bright.rotated(&Rotation::about(Direction::UP, 1.0));
        assert!((exposure_between(&lamp(10.0), &turned) - 0.25).abs() < 0.005);
    }

    #[test]
    fn a_lamp_comes_from_one_side_and_even_light_from_all() {
        for azimuth in [0.0, 60.0, 180.0] {
            assert!(directedness(&lamp(azimuth)) > 0.99);
        }
        let weak = DiscLamp {
            ambient: 1.5,
            ..DiscLamp::default()
        };
        assert_eq!(directedness(&weak.light(Order::TWO)), 0.0);
        assert_eq!(directedness(&ShLight::even(Order::TWO, [1.0; 3])), 0.0);
    }

    #[test]
    fn no_light_is_refused() {
        let dark = LightSource::Coefficients(ShLight::dark(Order::TWO));
        assert!(dark.light().is_err());
        assert!(LightSource::Lamp(DiscLamp::default()).light().is_ok());
    }
}
