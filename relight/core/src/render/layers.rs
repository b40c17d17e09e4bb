//! The layers together: an image of a surface under a light, and the derivatives of a loss back through it.

use std::array;
use std::f32::consts::FRAC_1_PI;

use super::diffuse::{DiffuseForm, DiffuseLayer};
use super::lobe::LobeLayer;
use super::power::PowerLayer;
use super::surface::{Surface, check};
use super::{Specular, highlight};
use crate::image::{Extent, ImageError, Linear, Planes, Rgb};
use crate::light::ShLight;
use crate::parallel;

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
    /// Where the albedo has another size.
    pub fn image(&self, albedo: &Rgb<Linear>) -> Result<Rgb<Linear>, ImageError> {
        let mut image = self.shading.clone();
        let extent = image.planes().extent();
        check("map of albedo", albedo.planes().extent(), extent)?;
        let factors = albedo.planes().planes();
        for (plane, factors) in image.planes_mut().planes_mut().into_iter().zip(factors) {
            plane.iter_mut().zip(factors).for_each(|(v, a)| *v *= a);
        }
        if let Some(highlight) = &self.highlight {
            check("highlight", highlight.planes().extent(), extent)?;
            let terms = highlight.planes().planes();
            for (plane, terms) in image.planes_mut().planes_mut().into_iter().zip(terms) {
                plane.iter_mut().zip(terms).for_each(|(v, h)| *v += h);
            }
        }
        Ok(image)
    }
}

/// The derivatives of a loss by all that an image is rendered from. They are 0 where there is no
/// surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Gradients {
    /// By x, y and z of the normals, each taken as a free variable of the layers' polynomials. Only
    /// the part that is tangential to the normal has a meaning on the sphere.
    pub normals: Planes<3>,
    /// By the albedo.
    pub albedo: Planes<3>,
    /// By s_p.
    pub reflectance: Planes<3>,
    /// By α.
    pub smoothness: Planes<1>,
    /// By the light's coefficients, of the light's order, at least 2.
    pub light: ShLight,
}

impl Layers {
    /// The layers for a light. The diffuse layer and [`SpecularForm::Power`] take its first nine
    /// coefficients, [`SpecularForm::Lobe`] takes all.
    #[must_use]
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
    #[must_use]
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

    /// The derivatives of a loss by what the surface's image I = A S + H is rendered from, given
    /// `upstream`, those by the image. All in `f64` inside; sums do not depend on the threads.
    ///
    /// # Errors
    /// Where `upstream` has another size than the surface.
    pub fn backward(
        &self,
        surface: &Surface,
        upstream: &Planes<3>,
    ) -> Result<Gradients, ImageError> {
        check("image of derivatives", upstream.extent(), surface.extent())?;
        let order = match &self.specular {
            SpecularLayer::Lobe(layer) => layer.light_order(),
            SpecularLayer::Power(layer) => layer.light_order(),
        };
        let Extent { width, height } = surface.extent();
        let mut gradients = Gradients {
            normals: Planes::zeros(surface.extent()),
            albedo: Planes::zeros(surface.extent()),
            reflectance: Planes::zeros(surface.extent()),
            smoothness: Planes::zeros(surface.extent()),
            light: ShLight::dark(order.max(DiffuseLayer::ORDER)),
        };
        let rows: Vec<Row> = parallel::map(height, |y| {
            let mut row = Row {
                pixels: Vec::with_capacity(width),
                light: vec![[0.0; 3]; gradients.light.coefficients().len()],
            };
            for x in 0..width {
                let pixel = self.pixel_backward(surface, upstream, [x, y], &mut row.light);
                row.pixels.push(pixel);
            }
            row
        });
        for (y, row) in rows.into_iter().enumerate() {
            row.store(y, &mut gradients);
        }
        Ok(gradients)
    }

    fn pixel_backward(
        &self,
        surface: &Surface,
        upstream: &Planes<3>,
        [x, y]: [usize; 2],
        light: &mut [[f64; 3]],
    ) -> PixelGradients {
        let mut result = PixelGradients::default();
        let normal = surface.normals().planes().pixel(x, y).map(f64::from);
        if normal == [0.0; 3] {
            return result;
        }
        let upstream = upstream.pixel(x, y).map(f64::from);
        let albedo = surface.albedo().planes().pixel(x, y).map(f64::from);
        let shading = self.diffuse.at(normal);
        result.albedo = array::from_fn(|c| upstream[c] * shading[c]);
        let by_shading = array::from_fn(|c| upstream[c] * albedo[c]);
        result.normal = self.diffuse.backward(normal, by_shading, light);
        if let Some(gloss) = surface.gloss() {
            let reflectance = gloss.reflectance().pixel(x, y).map(f64::from);
            let smoothness = f64::from(gloss.smoothness().pixel(x, y)[0]);
            let by_sum = array::from_fn(|c| upstream[c] * reflectance[c]);
            let (sum, (by_normal, by_smoothness)) = match &self.specular {
                SpecularLayer::Lobe(layer) => (
                    layer.at(normal, smoothness),
                    layer.backward(normal, smoothness, by_sum, light),
                ),
                SpecularLayer::Power(layer) => (
                    layer.at(normal, smoothness),
                    layer.backward(normal, smoothness, by_sum, light),
                ),
            };
            result.reflectance = array::from_fn(|c| upstream[c] * sum[c]);
            result.normal = array::from_fn(|axis| result.normal[axis] + by_normal[axis]);
            result.smoothness = by_smoothness;
        }
        result
    }
}

/// The derivatives by what belongs to one pixel.
#[derive(Debug, Clone, Copy, Default)]
struct PixelGradients {
    normal: [f64; 3],
    albedo: [f64; 3],
    reflectance: [f64; 3],
    smoothness: f64,
}

/// The derivatives of one row.
struct Row {
    pixels: Vec<PixelGradients>,
    light: Vec<[f64; 3]>,
}

impl Row {
    fn store(self, y: usize, gradients: &mut Gradients) {
        let single = |values: [f64; 3]| values.map(|v| v as f32);
        for (x, pixel) in self.pixels.into_iter().enumerate() {
            gradients.normals.set_pixel(x, y, single(pixel.normal));
            gradients.albedo.set_pixel(x, y, single(pixel.albedo));
            gradients
                .reflectance
                .set_pixel(x, y, single(pixel.reflectance));
            gradients
                .smoothness
                .set_pixel(x, y, [pixel.smoothness as f32]);
        }
        for (sums, values) in gradients
            .light
            .coefficients_mut()
            .iter_mut()
            .zip(self.light)
        {
            for (sum, v) in sums.iter_mut().zip(values) {
                *sum += v;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{Normals, Order};
    use crate::render::Gloss;
    use proptest::prelude::*;

    /// One pixel and all that it is rendered from.
    #[derive(Debug, Clone)]
    struct Case {
        light: Vec<[f64; 3]>,
        normal: [f64; 3],
        albedo: [f64; 3],
        reflectance: [f64; 3],
        smoothness: f64,
        upstream: [f64; 3],
    }

    fn cases(order: usize) -> impl Strategy<Value = Case> {
        let colour = || prop::array::uniform3(0.05..1.0);
        let count = (order + 1) * (order + 1);
        (
            prop::collection::vec(prop::array::uniform3(-0.15..0.15), count),
            prop::array::uniform2(-0.65..0.65),
            [colour(), colour(), colour()],
            3.0..120.0,
        )
            .prop_map(
                |(mut light, [x, y], [albedo, reflectance, upstream], smoothness)| {
                    // So bright that neither radiance nor shading is cut off at 0.
                    light[0] = [4.0, 4.5, 5.0];
                    Case {
                        light,
                        normal: [x, y, f64::sqrt(1.0 - x * x - y * y)],
                        albedo,
                        reflectance,
                        smoothness,
                        upstream,
                    }
                },
            )
    }

    impl Case {
        fn layers(&self, diffuse: DiffuseForm, specular: SpecularForm) -> Layers {
            let light = ShLight::new(self.light.clone()).unwrap();
            Layers::new(&light, diffuse, specular)
        }

        /// The loss: the image, weighted with `upstream`, in `f64`.
        fn loss(&self, diffuse: DiffuseForm, specular: SpecularForm) -> f64 {
            let layers = self.layers(diffuse, specular);
            let shading = layers.diffuse.at(self.normal);
            let sum = match &layers.specular {
                SpecularLayer::Lobe(layer) => layer.at(self.normal, self.smoothness),
                SpecularLayer::Power(layer) => layer.at(self.normal, self.smoothness),
            };
            (0..3)
                .map(|c| {
                    self.upstream[c] * (self.albedo[c] * shading[c] + self.reflectance[c] * sum[c])
                })
                .sum()
        }

        fn gradients(
            &self,
            diffuse: DiffuseForm,
            specular: SpecularForm,
        ) -> (PixelGradients, Vec<[f64; 3]>) {
            let extent = Extent::new(1, 1);
            let single = |v: [f64; 3]| Planes::filled(extent, v.map(|v| v as f32));
            let gloss = Gloss::even(
                extent,
                self.reflectance.map(|v| v as f32),
                self.smoothness as f32,
            );
            let normals = Normals::new(single(self.normal));
            let surface =
                Surface::new(normals, Rgb::new(single(self.albedo)), Some(gloss)).unwrap();
            let mut light = vec![[0.0; 3]; self.light.len()];
            let pixel = self.layers(diffuse, specular).pixel_backward(
                &surface,
                &single(self.upstream),
                [0, 0],
                &mut light,
            );
            (pixel, light)
        }

        /// The derivative by what `change` moves by a small step, by central differences.
        fn difference(
            &self,
            forms: (DiffuseForm, SpecularForm),
            step: f64,
            change: impl Fn(&mut Self, f64),
        ) -> f64 {
            let at = |by: f64| {
                let mut moved = self.clone();
                change(&mut moved, by);
                moved.loss(forms.0, forms.1)
            };
            // Four points: the error is of the fourth order.
            (8.0 * (at(step) - at(-step)) - (at(2.0 * step) - at(-2.0 * step))) / (12.0 * step)
        }
    }

    fn check_case(case: &Case, forms: (DiffuseForm, SpecularForm)) -> Result<(), TestCaseError> {
        let (pixel, light) = case.gradients(forms.0, forms.1);
        let mut pairs = Vec::new();
        for c in 0..3 {
            let by = |change: fn(&mut Case) -> &mut [f64; 3]| {
                case.difference(forms, 1e-4, move |case, by| change(case)[c] += by)
            };
            pairs.push(("normal", pixel.normal[c], by(|case| &mut case.normal)));
            pairs.push(("albedo", pixel.albedo[c], by(|case| &mut case.albedo)));
            pairs.push((
                "s_p",
                pixel.reflectance[c],
                by(|case| &mut case.reflectance),
            ));
        }
        for (at, ours) in light.iter().enumerate() {
            for (c, ours) in ours.iter().enumerate() {
                let difference = case.difference(forms, 1e-3, |case, by| case.light[at][c] += by);
                pairs.push(("light", *ours, difference));
            }
        }
        let by_smoothness = case.difference(forms, 1e-3, |case, by| case.smoothness += by);
        pairs.push(("alpha", pixel.smoothness, by_smoothness));
        for (what, ours, difference) in pairs {
            // The pixel's inputs are rounded to f32, the differences' are not.
            let size = difference.abs().max(1e-3);
            prop_assert!(
                (ours - difference).abs() <= 1e-3 * size,
                "{what}: {ours} {difference}"
            );
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn the_lobe_s_derivatives_are_those_of_finite_differences(case in cases(4)) {
            check_case(&case, (DiffuseForm::Irradiance, SpecularForm::Lobe))?;
        }

        #[test]
        fn the_derivatives_of_the_paper_s_layers_are_those_of_finite_differences(case in cases(2)) {
            check_case(&case, (DiffuseForm::Released, SpecularForm::Power))?;
        }
    }

    fn sphere() -> (Surface, Layers) {
        let normals = Normals::sphere(21);
        let albedo = Rgb::new(Planes::filled(normals.extent(), [0.5, 0.6, 0.7]));
        let gloss = Gloss::even(normals.extent(), [0.2; 3], 30.0);
        let light = ShLight::even(Order::TWO, [1.0, 2.0, 3.0]);
        let layers = Layers::new(&light, DiffuseForm::Irradiance, SpecularForm::Lobe);
        (Surface::new(normals, albedo, Some(gloss)).unwrap(), layers)
    }

    #[test]
    fn an_image_is_albedo_times_shading_and_highlight() {
        let (surface, layers) = sphere();
        let rendering = layers.render(&surface);
        let image = rendering.image(surface.albedo()).unwrap();
        let at = |image: &Rgb<Linear>| image.planes().pixel(8, 13)[1];
        let expected = 0.6 * at(&rendering.shading) + at(rendering.highlight.as_ref().unwrap());
        assert!((at(&image) - expected).abs() < 1e-5);
        assert!(expected > 0.6 * 6.2);
    }

    #[test]
    fn the_derivative_of_a_whole_image_by_the_light_is_the_sum_over_its_pixels() {
        let (surface, layers) = sphere();
        let mut upstream = Planes::zeros(surface.extent());
        upstream.set_pixel(10, 10, [1.0; 3]);
        let one = layers.backward(&surface, &upstream).unwrap();
        upstream.set_pixel(4, 9, [1.0; 3]);
        let both = layers.backward(&surface, &upstream).unwrap();
        upstream.set_pixel(10, 10, [0.0; 3]);
        let other = layers.backward(&surface, &upstream).unwrap();
        for at in 0..9 {
            let [a, b, c] = [&one, &other, &both].map(|g| g.light.coefficients()[at][2]);
            assert!((a + b - c).abs() < 1e-9);
        }
        assert_eq!(both.normals.pixel(0, 0), [0.0; 3]);
        assert_eq!(both.albedo.pixel(10, 10), one.albedo.pixel(10, 10));
    }

    #[test]
    fn derivatives_of_another_size_are_refused() {
        let (surface, layers) = sphere();
        let upstream = Planes::zeros(Extent::new(2, 2));
        assert!(layers.backward(&surface, &upstream).is_err());
    }
}
