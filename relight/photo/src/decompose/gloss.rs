//! The gloss of a whole object out of its highlight: s_p and alpha of the render layers' lobe.

use relight_core::image::{ImageError, Planes};
use relight_core::light::{Normals, ShLight};
use relight_core::render::{Gloss, LobeLayer};

/// The smoothnesses that are tried.
const SMOOTHNESSES: [f32; 12] = [
    5.0, 8.0, 12.0, 18.0, 26.0, 36.0, 50.0, 70.0, 95.0, 125.0, 160.0, 200.0,
];

/// Gloss that is the same all over an object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedGloss {
    /// Specular reflectance s_p, the same in all channels: the highlight is grey.
    pub reflectance: f32,
    /// Smoothness alpha.
    pub smoothness: f32,
    /// The root mean square of what the lobe does not explain of the highlight, over that of the
    /// highlight: 0 to 1.
    pub residual: f64,
}

/// The gloss whose highlight in this light is nearest to the given one: the best of a few
/// smoothnesses, each with its s_p by least squares. `None` without a highlight that
/// the light explains.
pub fn fit_gloss(
    light: &ShLight,
    normals: &Normals,
    highlight: &Planes<1>,
) -> Result<Option<FittedGloss>, ImageError> {
    let layer = LobeLayer::new(light);
    let target = highlight.plane(0);
    let energy = product(target, target);
    let mut best: Option<FittedGloss> = None;
    for smoothness in SMOOTHNESSES {
        let gloss = Gloss::even(normals.extent(), [1.0; 3], smoothness);
        let image = layer.highlight(normals, &gloss)?;
        let [lobe, ..] = image.planes().planes();
        let (shared, own) = (product(lobe, target), product(lobe, lobe));
        if shared <= 0.0 || own <= 0.0 || energy <= 0.0 {
            continue;
        }
        let rest = (1.0 - shared * shared / (own * energy)).max(0.0);
        let found = FittedGloss {
            reflectance: (shared / own) as f32,
            smoothness,
            residual: rest.sqrt(),
        };
        if best.is_none_or(|best| found.residual < best.residual) {
            best = Some(found);
        }
    }
    Ok(best)
}

fn product(a: &[f32], b: &[f32]) -> f64 {
    let pairs = a.iter().zip(b);
    pairs.map(|(&a, &b)| f64::from(a) * f64::from(b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::light::Order;

    fn lamp() -> ShLight {
        let mut light = ShLight::even(Order::TWO, [1.0; 3]);
        light.coefficients_mut()[1] = [2.0; 3];
        light.coefficients_mut()[3] = [-1.0; 3];
        light.coefficients_mut()[5] = [0.8; 3];
        light
    }

    #[test]
    fn the_gloss_of_a_rendered_highlight_is_found() {
        let normals = Normals::sphere(48);
        let layer = LobeLayer::new(&lamp());
        for (reflectance, smoothness) in [(0.3, 12.0), (0.8, 50.0), (2.0, 160.0)] {
            let gloss = Gloss::even(normals.extent(), [reflectance; 3], smoothness);
            let image = layer.highlight(&normals, &gloss).unwrap();
            let grey = image.planes().plane(0).to_vec();
            let grey = Planes::from_planes(normals.extent(), [grey]).unwrap();
            let found = fit_gloss(&lamp(), &normals, &grey).unwrap().unwrap();
            assert_eq!(found.smoothness, smoothness);
            assert!((found.reflectance / reflectance - 1.0).abs() < 1e-4);
            assert!(found.residual < 1e-3, "{}", found.residual);
        }
    }

    #[test]
    fn no_highlight_has_no_gloss() {
        let normals = Normals::sphere(16);
        let none = Planes::zeros(normals.extent());
        assert_eq!(fit_gloss(&lamp(), &normals, &none).unwrap(), None);
    }
}
