//! Images of a surface under turning light, and how bright they are shown.

use std::f64::consts::PI;

use super::diffuse::{DiffuseForm, DiffuseLayer};
use super::layers::{Layers, SpecularForm};
use super::surface::Surface;
use crate::image::{ImageError, Linear, Rgb};
use crate::light::{Direction, Rotation, ShLight};

/// How a surface is rendered and shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RenderSettings {
    /// The diffuse layer.
    pub diffuse: DiffuseForm,
    /// The specular layer.
    pub specular: SpecularForm,
    /// What the image I = A S + H is multiplied with.
    pub exposure: f32,
}

impl RenderSettings {
    /// The image of a surface under a light.
    ///
    /// # Errors
    /// None for a surface, whose maps have one size; those of [`super::Rendering::image`] in general.
    pub fn image(&self, surface: &Surface, light: &ShLight) -> Result<Rgb<Linear>, ImageError> {
        let rendering = Layers::new(light, self.diffuse, self.specular).render(surface);
        let image = rendering.image(surface.albedo())?;
        Ok(Rgb::new(image.into_planes().map(|v| v * self.exposure)))
    }

    /// The image when the light has turned about the vertical by `part` of a turn (+y, right-hand rule:
    /// from the viewer to the right).
    ///
    /// # Errors
    /// As [`RenderSettings::image`].
    pub fn turned(
        &self,
        surface: &Surface,
        light: &ShLight,
        part: f64,
    ) -> Result<Rgb<Linear>, ImageError> {
        let turn = Rotation::about(Direction::UP, 2.0 * PI * part);
        self.image(surface, &light.rotated(&turn))
    }
}

/// The s_p with which a surface of smoothness α that faces the viewer reflects this part of even light:
/// part (α + 2) / 8. H alone, with a fixed s_p, falls with α as 8π / (α + 2).
pub fn mirror_reflectance(part: f32, smoothness: f32) -> f32 {
    part * (smoothness + 2.0) / 8.0
}

/// The exposure that shows a white diffuse surface, turned to where the light is strongest, as 1. It does not
/// change when the light turns.
pub fn exposure_for(light: &ShLight) -> f32 {
    let layer = DiffuseLayer::new(light, DiffuseForm::Irradiance);
    let (rows, columns) = (24, 48);
    let brightest = (0..=rows * columns)
        .flat_map(|at| {
            let polar = PI * f64::from(at / columns) / f64::from(rows);
            let azimuth = 2.0 * PI * f64::from(at % columns) / f64::from(columns);
            layer.at(Direction::from_angles(polar, azimuth).components())
        })
        .fold(0.0, f64::max);
    if brightest > 0.0 {
        (1.0 / brightest) as f32
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Planes;
    use crate::light::{Normals, Order};
    use crate::render::Gloss;

    const LOOK: RenderSettings = RenderSettings {
        diffuse: DiffuseForm::Irradiance,
        specular: SpecularForm::Lobe,
        exposure: 1.0,
    };

    /// A white ball, and light from the viewer.
    fn scene() -> (Surface, ShLight) {
        let normals = Normals::sphere(31);
        let white = Rgb::new(Planes::filled(normals.extent(), [1.0; 3]));
        let mut light = ShLight::even(Order::TWO, [1.0; 3]);
        light.coefficients_mut()[2] = [2.0; 3];
        (Surface::new(normals, white, None).unwrap(), light)
    }

    fn brightest_column(image: &Rgb<Linear>) -> usize {
        let value = |x: usize| image.planes().pixel(x, 15)[0];
        (0..31)
            .max_by(|&a, &b| value(a).total_cmp(&value(b)))
            .unwrap()
    }

    #[test]
    fn light_turns_from_the_viewer_to_the_right() {
        let (surface, light) = scene();
        let column = |part| brightest_column(&LOOK.turned(&surface, &light, part).unwrap());
        assert_eq!(column(0.0), 15);
        assert!(column(0.125) > 22);
        assert!(column(0.875) < 8);
        assert_eq!(column(1.0), 15);
    }

    #[test]
    fn a_white_surface_towards_the_light_is_shown_as_white_wherever_the_light_is() {
        let (surface, light) = scene();
        for part in [0.0, 0.1] {
            let exposure = exposure_for(&light.rotated(&Rotation::about(Direction::UP, part)));
            let settings = RenderSettings { exposure, ..LOOK };
            let image = settings.turned(&surface, &light, part).unwrap();
            let most = image.planes().plane(0).iter().copied().fold(0.0, f32::max);
            assert!((most - 1.0).abs() < 0.01, "{most}");
        }
        assert_eq!(exposure_for(&ShLight::dark(Order::TWO)), 1.0);
    }

    #[test]
    fn a_mirror_reflectance_gives_back_its_part_of_even_light() {
        let (surface, _) = scene();
        let even = ShLight::even(Order::TWO, [2.0; 3]);
        let black = Rgb::new(Planes::zeros(surface.extent()));
        for smoothness in [5.0, 80.0] {
            let gloss = Gloss::even(
                surface.extent(),
                [mirror_reflectance(0.3, smoothness); 3],
                smoothness,
            );
            let mirror =
                Surface::new(surface.normals().clone(), black.clone(), Some(gloss)).unwrap();
            let settings = RenderSettings {
                exposure: super::super::EXPOSURE,
                ..LOOK
            };
            let image = settings.image(&mirror, &even).unwrap();
            assert!((image.planes().pixel(15, 15)[0] - 0.6).abs() < 0.01);
        }
    }
}
