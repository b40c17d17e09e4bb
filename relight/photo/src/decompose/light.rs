//! The light of a photograph: the network's prediction, and the fit to the shading that starts from it.

use crate::nets::LIGHT_OUTPUTS;
use relight_core::image::{Linear, Rgb};
use relight_core::light::{LightError, Normals, Order, ShLight};
use relight_core::render::{cosine_lobe, fit_light_near};

/// Keeps the light from behind, which normals hardly show, small: see [`fit_light_near`].
const STIFFNESS: f64 = 1e-3;
/// The same towards the network's prediction. Chosen on synthetic objects: a stiffer fit finds the light's side a little better
/// and explains the shading less (docs/results/decomposition.md).
const STIFFNESS_TO_PREDICTION: f64 = 1e-2;
/// Longest band 1 of a light, in parts of its mean. A single lamp has √3; far above it, the fit follows cast shadows to
/// a light that is negative in most directions.
const MAX_ONE_SIDED: f64 = 2.5;
/// How often the light is fitted with four times the stiffness, at most.
const STIFFER_FITS: usize = 8;
/// The coefficients that change sign in the mirror image, left and right: those that are odd in x.
const ODD_IN_X: [usize; 3] = [3, 4, 7];

/// The output of the network's head for light: coefficients of order 2 of the unblocked grey irradiance, in units of the mean
/// shading of the object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedLight([f64; LIGHT_OUTPUTS]);

impl PredictedLight {
    /// From the network's output; `None` if it has another length.
    pub(super) fn from_output(answer: &[f32]) -> Option<Self> {
        let numbers: [f32; LIGHT_OUTPUTS] = answer.try_into().ok()?;
        let is_light = numbers.iter().all(|value| value.is_finite());
        is_light.then(|| Self(numbers.map(f64::from)))
    }

    /// What the network should answer of the coefficients of a light, in which the mean shading of an object is `mean`,
    /// above 0.
    pub fn from_light(coefficients: &[[f64; 3]; LIGHT_OUTPUTS], mean: f64) -> Self {
        let irradiance = |at: usize| {
            let grey = coefficients[at].iter().sum::<f64>() / 3.0;
            cosine_lobe(at.isqrt()) * grey / mean
        };
        Self(std::array::from_fn(irradiance))
    }

    /// The numbers.
    pub const fn numbers(&self) -> &[f64; LIGHT_OUTPUTS] {
        &self.0
    }

    /// That of the mirror image, left and right.
    pub(super) fn mirrored(mut self) -> Self {
        for at in ODD_IN_X {
            self.0[at] = -self.0[at];
        }
        self
    }

    pub(super) fn mean(self, other: Self) -> Self {
        Self(std::array::from_fn(|at| self.0[at].midpoint(other.0[at])))
    }

    fn light(&self) -> Result<ShLight, LightError> {
        let numbers = self.0.iter().enumerate();
        ShLight::new(
            numbers
                .map(|(at, n)| [n / cosine_lobe(at.isqrt()); 3])
                .collect(),
        )
    }
}

/// The light of a shading, grey and of mean 1: the nearest one by least squares, regularised towards the network's
/// prediction, if it gives one. The stiffness grows while the light is too one-sided to exist.
pub(super) fn light_of_shading(
    normals: &Normals,
    shading: &Rgb<Linear>,
    known: &[bool],
    predicted: Option<&PredictedLight>,
) -> Result<ShLight, LightError> {
    let (near, mut stiffness) = match predicted {
        Some(predicted) => (predicted.light()?, STIFFNESS_TO_PREDICTION),
        None => (ShLight::dark(Order::TWO), STIFFNESS),
    };
    let fitted = |stiffness| fit_light_near(&near, normals, shading, known, stiffness);
    let mut light = fitted(stiffness)?;
    for _ in 0..STIFFER_FITS {
        if !is_too_one_sided(&light) {
            break;
        }
        stiffness *= 4.0;
        light = fitted(stiffness)?;
    }
    Ok(light)
}

/// Whether band 1 is longer than that of any light; it is grey, so one channel suffices.
fn is_too_one_sided(light: &ShLight) -> bool {
    let [mean, a, b, c] = [0, 1, 2, 3].map(|at: usize| light.coefficients()[at][1]);
    (a * a + b * b + c * c).sqrt() > MAX_ONE_SIDED * mean
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use relight_core::image::{Extent, Planes};
    use relight_core::render::{DiffuseForm, DiffuseLayer, fit_light};

    /// Lit from the right, above and the viewer's side.
    const LOPSIDED: [f64; 9] = [1.0, 0.4, 0.3, 0.5, 0.1, -0.1, 0.05, 0.2, 0.15];

    fn lopsided(mean: f64) -> PredictedLight {
        PredictedLight::from_light(&LOPSIDED.map(|c| [c; 3]), mean)
    }

    fn grey(shading: &[f32], extent: Extent) -> Rgb<Linear> {
        let plane = shading.to_vec();
        Rgb::new(Planes::from_planes(extent, [plane.clone(), plane.clone(), plane]).unwrap())
    }

    #[test]
    fn a_shading_with_hard_shadows_has_a_light_that_there_can_be() {
        let normals = Normals::sphere(33);
        // Bright where the surface turns far to the right, and black elsewhere.
        let shadowed = normals.planes().plane(0).iter();
        let plane: Vec<f32> = shadowed.map(|x| if *x > 0.6 { 3.0 } else { 0.0 }).collect();
        let (shading, known) = (grey(&plane, Extent::new(33, 33)), vec![true; 33 * 33]);
        let nearest = fit_light(&normals, &shading, &known, STIFFNESS).unwrap();
        assert!(is_too_one_sided(&nearest), "{nearest:?}");
        let possible = light_of_shading(&normals, &shading, &known, None).unwrap();
        assert!(!is_too_one_sided(&possible), "{possible:?}");
    }

    #[test]
    fn what_is_said_of_a_light_is_that_light_again() {
        let said = lopsided(1.0).light().unwrap();
        for (said, expected) in said.coefficients().iter().zip(LOPSIDED) {
            assert!((said[1] - expected).abs() < 1e-12);
        }
        // Half as bright in units of twice the mean.
        assert!((lopsided(2.0).numbers()[0] - 0.5 * PI).abs() < 1e-12);
    }

    #[test]
    fn in_the_mirror_image_light_comes_from_the_other_side() {
        let irradiance = |light: PredictedLight, normal: [f32; 3]| {
            let normals = Normals::new(Planes::filled(Extent::new(1, 1), normal));
            let layer = DiffuseLayer::new(&light.light().unwrap(), DiffuseForm::Irradiance);
            layer.shading(&normals).planes().plane(0)[0]
        };
        for normal in [[0.6, 0.8, 0.0], [-0.48, 0.64, 0.6], [0.0, 0.0, 1.0]] {
            let [x, y, z] = normal;
            let own = irradiance(lopsided(1.0), normal);
            let mirrored = irradiance(lopsided(1.0).mirrored(), [-x, y, z]);
            assert!((own - mirrored).abs() < 1e-5, "{own} {mirrored}");
        }
    }

    #[test]
    fn where_the_object_shows_nothing_of_the_light_the_prediction_counts() {
        // All of the surface faces the viewer: it says nothing of right and left.
        let extent = Extent::new(8, 8);
        let normals = Normals::new(Planes::filled(extent, [0.0, 0.0, 1.0]));
        let shading = grey(&[1.0; 64], extent);
        let light =
            light_of_shading(&normals, &shading, &[true; 64], Some(&lopsided(1.0))).unwrap();
        assert!((light.coefficients()[3][1] - 0.5).abs() < 1e-6);
    }
}
