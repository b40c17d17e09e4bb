//! The layers together: an image of a surface under a light.

use std::f32::consts::FRAC_1_PI;

use super::diffuse::{DiffuseForm, DiffuseLayer};
use super::highlight;
use super::lobe::LobeLayer;
use super::power::PowerLayer;
use super::surface::Surface;
use crate::image::{ImageError, Linear, Rgb, check_extent};
use crate::light::ShLight;

/// The factor that brings a white diffuse surface under even light of radiance 1 to 1, as a background
/// of that light is.
pub const EXPOSURE: f32 = FRAC_1_PI;

/// Which specular layer renders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SpecularForm {
    /// [`LobeLayer`].
    #[default]
    Lobe,
    /// [`PowerLayer`].
    Power,
}

/// Both layers for one light.
///
/// ```
/// use relight_core::image::{Planes, Rgb};
/// use relight_core::light::{Normals, Order, ShLight};
/// use relight_core::render::{DiffuseForm, EXPOSURE, Layers, SpecularForm, Surface};
///
/// let light = ShLight::even(Order::TWO, [1.0; 3]);
/// let layers = Layers::new(&light, DiffuseForm::Irradiance, SpecularForm::Lobe);
/// let normals = Normals::sphere(9);
/// let white = Rgb::new(Planes::filled(normals.extent(), [1.0; 3]));
/// let surface = Surface::new(normals, white, None)?;
/// let image = layers.render(&surface).image(surface.albedo())?;
/// assert!((image.planes().pixel(4, 4)[0] * EXPOSURE - 1.0).abs() < 1e-5);
/// # Ok::<(), relight_core::image::ImageError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Layers {
    diffuse: DiffuseLayer,
    specular: SpecularLayer,
}

#[derive(Debug, Clone)]
enum SpecularLayer {
    Lobe(LobeLayer),
    Power(PowerLayer),
}

/// Shading and highlight of a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Rendering {
    /// S.
    pub shading: Rgb<Linear>,
    /// H; nothing for a diffuse surface.
    pub highlight: Option<Rgb<Linear>>,
}

impl Rendering {
    /// The image I = A S + H.
    ///
    /// # Errors
    /// If the albedo has another size.
    pub fn image(&self, albedo: &Rgb<Linear>) -> Result<Rgb<Linear>, ImageError> {
        let mut image = self.shading.clone();
        let extent = image.planes().extent();
        check_extent("map of albedo", albedo.planes().extent(), extent)?;
        let factors = albedo.planes().planes();
        for (plane, factors) in image.planes_mut().planes_mut().into_iter().zip(factors) {
            plane.iter_mut().zip(factors).for_each(|(v, a)| *v *= a);
        }
        if let Some(highlight) = &self.highlight {
            check_extent("highlight", highlight.planes().extent(), extent)?;
            let terms = highlight.planes().planes();
            for (plane, terms) in image.planes_mut().planes_mut().into_iter().zip(terms) {
                plane.iter_mut().zip(terms).for_each(|(v, h)| *v += h);
            }
        }
        Ok(image)
    }
}

impl Layers {
    /// The layers for a light. [`DiffuseForm::Released`] and [`SpecularForm::Power`] take its first nine
    /// coefficients, [`DiffuseForm::Irradiance`] and [`SpecularForm::Lobe`] take all.
    pub fn new(light: &ShLight, diffuse: DiffuseForm, specular: SpecularForm) -> Self {
        Self {
            diffuse: DiffuseLayer::new(light, diffuse),
            specular: match specular {
                SpecularForm::Lobe => SpecularLayer::Lobe(LobeLayer::new(light)),
                SpecularForm::Power => SpecularLayer::Power(PowerLayer::new(light)),
            },
        }
    }

    /// Shading and highlight of a surface.
    pub fn render(&self, surface: &Surface) -> Rendering {
        let highlight = surface.gloss().and_then(|gloss| {
            // A surface's maps have one size, so that there is a highlight.
            match &self.specular {
                SpecularLayer::Lobe(layer) => highlight(layer, surface.normals(), gloss).ok(),
                SpecularLayer::Power(layer) => highlight(layer, surface.normals(), gloss).ok(),
            }
        });
        Rendering {
            shading: self.diffuse.shading(surface.normals()),
            highlight,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Planes;
    use crate::light::{Normals, Order};
    use crate::render::Gloss;

    #[test]
    fn an_image_is_albedo_times_shading_and_highlight() {
        let normals = Normals::sphere(21);
        let albedo = Rgb::new(Planes::filled(normals.extent(), [0.5, 0.6, 0.7]));
        let gloss = Gloss::even(normals.extent(), [0.2; 3], 30.0);
        let light = ShLight::even(Order::TWO, [1.0, 2.0, 3.0]);
        let layers = Layers::new(&light, DiffuseForm::Irradiance, SpecularForm::Lobe);
        let surface = Surface::new(normals, albedo, Some(gloss)).unwrap();
        let rendering = layers.render(&surface);
        let image = rendering.image(surface.albedo()).unwrap();
        let at = |image: &Rgb<Linear>| image.planes().pixel(8, 13)[1];
        let expected = 0.6 * at(&rendering.shading) + at(rendering.highlight.as_ref().unwrap());
        assert!((at(&image) - expected).abs() < 1e-5);
        assert!(expected > 0.6 * 6.2);
    }
}
