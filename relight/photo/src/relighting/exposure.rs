//! How bright a panorama and the objects in it are shown: one exposure for both, as a camera has it.

use relight_core::image::{Extent, Linear, Rgb};
use relight_core::light::{Normals, ShLight};
use relight_core::render::{DiffuseForm, DiffuseLayer, exposure_for};
use relit_data::statistics::above_part;

/// The value that one pixel in [`BRIGHTEST_PART`] exceeds in its brightest channel.
const BRIGHT: f32 = 0.8;
/// The part of the pixels that is brighter.
const BRIGHTEST_PART: f64 = 0.05;
/// As what a white diffuse surface is shown in the brightest light of a panorama, before it is exposed: bright places clip, as in
/// photographs. Objects in it are shown by as much brighter than in their photographs, in which white does not clip.
pub(crate) const WHITE: f32 = 1.4;
/// The least and the most that the mean light on the side of an object that is seen is shown as, where the strongest light of its
/// photograph was 1: an object against the light does not become black, and one in it is not bleached.
const OBJECT: (f32, f32) = (0.25, 0.9);

/// How a panorama and its light are exposed.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct PanoramaExposure {
    /// Stops from the exposure in which the strongest light is as strong as in the objects' photographs.
    pub stops: f32,
    /// The part of the picture's pixels that is clipped.
    pub clipped: f32,
    /// Whether the objects asked for another exposure than the picture.
    pub for_objects: bool,
}

impl PanoramaExposure {
    /// The exposure in which one pixel in twenty of what is `seen` is brighter than 0.8, as far as objects in this light, where
    /// it is the same, are neither black nor bleached.
    pub(crate) fn new(seen: &Rgb<Linear>, light: Option<&ShLight>) -> Self {
        let bright = above_part(seen.planes().brightest(), 1.0 - BRIGHTEST_PART);
        let wanted = match bright {
            Some(value) if value > 0.0 => BRIGHT / value,
            _ => 1.0,
        };
        let gain = light.map_or(wanted, |light| {
            let facing = (WHITE * facing(light)).max(f32::MIN_POSITIVE);
            wanted.clamp(OBJECT.0 / facing, OBJECT.1 / facing)
        });
        Self {
            for_objects: gain != wanted,
            ..Self::fixed(seen, gain.log2())
        }
    }

    /// An exposure that is given.
    pub(crate) fn fixed(seen: &Rgb<Linear>, stops: f32) -> Self {
        let values = seen.planes().brightest();
        let clipped = values.filter(|value| *value * stops.exp2() >= 1.0);
        let pixels = seen.planes().extent().pixels();
        Self {
            stops,
            clipped: clipped.count() as f32 / pixels.max(1) as f32,
            for_objects: false,
        }
    }

    /// The same, and so many stops brighter.
    pub(crate) fn brighter(self, seen: &Rgb<Linear>, stops: f32) -> Self {
        Self {
            for_objects: self.for_objects,
            ..Self::fixed(seen, self.stops + stops)
        }
    }
}

/// The exposure in which a white surface that faces the strongest light is white, or a brighter one: an object that is lit
/// from behind is shown as bright as before a panorama.
#[must_use]
pub fn exposure_for_object(light: &ShLight) -> f32 {
    let gain = WHITE * OBJECT.0 / facing(light);
    exposure_for(light) * if gain.is_finite() { gain.max(1.0) } else { 1.0 }
}

/// The mean irradiance on what is seen of a ball, as a part of the strongest.
fn facing(light: &ShLight) -> f32 {
    let ball = Normals::sphere(24);
    let shading = DiffuseLayer::new(light, DiffuseForm::Irradiance).shading(&ball);
    let Extent { width, height } = ball.extent();
    let (mut sum, mut count) = (0.0, 0.0);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        if ball.planes().pixel(x, y)[2] > 0.0 {
            sum += shading.planes().pixel(x, y).iter().sum::<f32>() / 3.0;
            count += 1.0;
        }
    }
    exposure_for(light) * sum / f32::max(count, 1.0)
}

#[cfg(test)]
mod tests {
    use super::super::DiscLamp;
    use super::*;
    use relight_core::image::Planes;
    use relight_core::light::Order;

    fn lamp(azimuth: f64) -> ShLight {
        DiscLamp {
            azimuth,
            ambient: 0.1,
            ..DiscLamp::default()
        }
        .light(Order::TWO)
    }

    fn ramp(most: f32) -> Rgb<Linear> {
        Rgb::new(Planes::from_fn(Extent::new(100, 20), |x, _| {
            [most * (x as f32 + 0.5) / 100.0; 3]
        }))
    }

    #[test]
    fn one_pixel_in_twenty_is_brighter_than_four_fifths_whatever_the_picture_was() {
        for most in [0.8, 1.0, 1.5] {
            let found = PanoramaExposure::new(&ramp(most), Some(&lamp(30.0)));
            let shown = 0.95 * most * found.stops.exp2();
            assert!((shown / BRIGHT - 1.0).abs() < 0.03, "{most}: {found:?}");
            assert!(found.clipped < 0.05 && !found.for_objects, "{found:?}");
        }
    }

    #[test]
    fn without_a_background_an_object_is_as_bright_in_front_light_and_not_black_against_it() {
        let exposure = |azimuth| {
            let light = lamp(azimuth);
            (
                exposure_for_object(&light),
                exposure_for(&light),
                facing(&light),
            )
        };
        let (found, strongest, _) = exposure(20.0);
        assert_eq!(found, strongest);
        let (found, strongest, facing) = exposure(180.0);
        assert!((found / strongest * facing - WHITE * OBJECT.0).abs() < 1e-4);
        let dark = ShLight::dark(Order::TWO);
        assert_eq!(exposure_for_object(&dark), exposure_for(&dark));
    }

    #[test]
    fn an_object_against_the_light_is_not_black_and_one_in_a_dark_room_is_not_bleached() {
        let behind = PanoramaExposure::new(&ramp(30.0), Some(&lamp(180.0)));
        assert!(behind.for_objects && behind.clipped > 0.1, "{behind:?}");
        let shown = WHITE * facing(&lamp(180.0)) * behind.stops.exp2();
        assert!((shown / OBJECT.0 - 1.0).abs() < 1e-3);
        let dark = PanoramaExposure::new(&ramp(0.01), Some(&lamp(0.0)));
        let shown = WHITE * facing(&lamp(0.0)) * dark.stops.exp2();
        assert!(dark.for_objects && (shown / OBJECT.1 - 1.0).abs() < 1e-3);
    }
}
