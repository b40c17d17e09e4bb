//! Light from a plain picture: it becomes part of a panorama, and the rest is extrapolated from it.

use std::f64::consts::PI;

use super::{LightSource, SeenSun};
use relight_core::image::{Extent, Linear, Planes, Rgb};
use relight_core::light::{Panorama, ShLight};

/// The size of the panorama that is made.
const MADE: Extent = Extent::new(128, 64);
/// The coarseness of the surroundings outside the picture.
const COARSE: Extent = Extent::new(12, 8);
/// Values from which on a picture is clipped: windows, lamps and the sky are brighter than it can show.
const CLIPPED: f32 = 0.92;
/// How many times as strong as the mean of all else the sun lights what faces it.
const SUN: f64 = 4.0;
/// The assumed brightness of clipped pixels, as a multiple.
const BEYOND: f32 = 6.0;

impl LightSource {
    /// The light that a picture of linear values shows, whose longer side shows `field` degrees: itself behind the object, and its
    /// mirror images, more and more blurred, at the sides and at the viewer. Clipped places count six times as bright.
    ///
    /// A sun that is seen in the picture lights four times as strongly as all else, from one place: its shadows are hard.
    ///
    /// It is a guess: most of a scene's light comes from outside the picture.
    pub(crate) fn from_picture(picture: &Rgb<Linear>, field: f64, sun: Option<SeenSun>) -> Self {
        let extent = picture.planes().extent();
        let radiance = picture.planes().clone().map(|v| {
            let v = if v.is_finite() { v.max(0.0) } else { 0.0 };
            if v >= CLIPPED { v * BEYOND } else { v }
        });
        let near = radiance.resized(downscaled(extent));
        let far = radiance.resized(COARSE);
        let longest = extent.width.max(extent.height).max(1) as f64;
        let half = (field.clamp(1.0, 150.0) / 2.0).to_radians();
        // Half the angles that the picture shows across and down.
        let angles = [extent.width, extent.height].map(|side| half * side as f64 / longest);
        let dark = Panorama::from_light(&ShLight::dark(relight_core::light::Order::TWO), MADE);
        let mut planes = Planes::from_fn(MADE, |x, y| {
            let across = ((x as f64 + 0.5) / MADE.width as f64 - 0.5) * 2.0 * PI / angles[0];
            let down = ((y as f64 + 0.5) / MADE.height as f64 - 0.5) * PI / angles[1];
            let is_inside = across.abs() <= 1.0 && down.abs() <= 1.0;
            let source = if is_inside { &near } else { &far };
            // Above the picture goes on what its upper edge shows, below it what its lower edge does.
            let place = [folded(across), down.clamp(-1.0, 1.0)];
            at(source, place)
        });
        if let Some(sun) = sun {
            add_sun(&mut planes, sun, angles);
        }
        Self::Panorama(Panorama::new(Rgb::new(planes)).unwrap_or(dark))
    }
}

/// Adds a sun that is seen in a picture; `angles` are half its angles of view.
fn add_sun(made: &mut Planes<3>, sun: SeenSun, angles: [f64; 2]) {
    let pixel = |place: f64, side: usize| {
        ((place + 0.5) * side as f64).clamp(0.0, side as f64 - 1.0) as usize
    };
    let x = pixel(sun.place[0] * angles[0] / (2.0 * PI), MADE.width);
    let y = pixel(sun.place[1] * angles[1] / PI, MADE.height);
    let solid_angle = |row: usize| {
        let polar = (row as f64 + 0.5) / MADE.height as f64 * PI;
        polar.sin() * (PI / MADE.height as f64) * (2.0 * PI / MADE.width as f64)
    };
    // The mean irradiance over all normals is a quarter of the sum of radiance times solid angle.
    let mut sum = 0.0;
    for (row, column) in (0..MADE.height).flat_map(|y| (0..MADE.width).map(move |x| (y, x))) {
        let grey = made.pixel(column, row).iter().sum::<f32>() / 3.0;
        sum += f64::from(grey) * solid_angle(row) / 4.0;
    }
    let radiance = (SUN * sum / solid_angle(y)) as f32;
    made.set_pixel(x, y, [radiance; 3]);
}

/// The picture's size, at most that of the panorama.
fn downscaled(extent: Extent) -> Extent {
    Extent::new(
        extent.width.clamp(1, MADE.width),
        extent.height.clamp(1, MADE.height),
    )
}

/// A place on a line of mirror images from -1 to 1.
fn folded(place: f64) -> f64 {
    let along = (place + 1.0).rem_euclid(4.0);
    if along <= 2.0 {
        along - 1.0
    } else {
        3.0 - along
    }
}

/// The pixel at a place from -1 to 1.
fn at(image: &Planes<3>, place: [f64; 2]) -> [f32; 3] {
    let Extent { width, height } = image.extent();
    let pixel =
        |place: f64, side: usize| (((place + 1.0) / 2.0 * side as f64) as usize).min(side - 1);
    image.pixel(pixel(place[0], width), pixel(place[1], height))
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::light::Direction;

    #[test]
    fn a_picture_that_is_bright_above_and_on_the_right_lights_from_there() {
        let picture = Rgb::new(Planes::from_fn(Extent::new(90, 60), |x, y| {
            [0.1 + 0.5 * (x as f32 / 90.0) * (1.0 - y as f32 / 60.0); 3]
        }));
        let source = LightSource::from_picture(&picture, 60.0, SeenSun::find(picture.planes()));
        let LightSource::Panorama(panorama) = &source else {
            panic!("a panorama")
        };
        let behind = Direction::new(0.0, 0.0, -1.0).unwrap();
        assert!((panorama.radiance(behind)[0] - 0.1 - 0.125).abs() < 0.03);
        let light = source.light().unwrap();
        let from = |x, y, z| light.radiance(Direction::new(x, y, z).unwrap())[0];
        assert!(from(0.2, 1.0, -0.4) > from(0.2, -1.0, -0.4));
    }

    #[test]
    fn a_sun_that_is_seen_lights_from_there_and_stronger_than_the_rest() {
        let picture = Rgb::new(Planes::from_fn(Extent::new(90, 60), |x, y| {
            let from = (x as f64 - 70.0).hypot(y as f64 - 10.0);
            let glow = 0.3 + 0.55 * (-(from - 3.0).max(0.0) / 5.0).exp();
            [if from < 3.0 { 1.0 } else { glow as f32 }; 3]
        }));
        let LightSource::Panorama(panorama) =
            LightSource::from_picture(&picture, 60.0, SeenSun::find(picture.planes()))
        else {
            panic!("a panorama")
        };
        // 70.5 of 90 columns is 17 degrees to the right, 10.5 of 60 rows 13 degrees up.
        let (sin, cos) = 17.0_f64.to_radians().sin_cos();
        let towards = Direction::new(sin, 13.0_f64.to_radians().tan(), -cos).unwrap();
        let light = panorama.project(relight_core::light::Order::HIGHLIGHT);
        let [there, away] = [towards, Direction::new(-sin, 0.0, cos).unwrap()]
            .map(|direction| light.radiance(direction)[1]);
        assert!(there > 5.0 * away.abs(), "{there} {away}");
    }

    #[test]
    fn mirror_images_join() {
        for place in [-1.0, 1.0, 3.0, -3.0] {
            assert!(
                (folded(place - 1e-6) - folded(place + 1e-6)).abs() < 1e-5,
                "{place}"
            );
        }
        assert_eq!([folded(0.5), folded(1.5), folded(-1.5)], [0.5, 0.5, -0.5]);
    }
}
