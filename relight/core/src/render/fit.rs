//! From a shading back to the light that made it.

use super::diffuse::terms;
use crate::image::{Linear, Rgb};
use crate::light::{Direction, LightError, NormalEquations, Normals, Order, ShLight};

/// Added to the equations, relative to their diagonal, so that few or equal normals have a light too.
const RIDGE: f64 = 1e-8;

/// The light of order 2 whose irradiance on the normals is nearest to the shading, by least squares over
/// the pixels where `mask` (row by row, as long as the image) is true and a normal is known: what the
/// paper's representation can hold of the shading.
///
/// `stiffness`, 0 or more, regularises the bands 1 and 2 towards 0, by that part of the equations' mean
/// diagonal. 0 gives the best fit; 1e-3 keeps light that the normals hardly show, such as that from
/// behind, small.
///
/// # Errors
/// If no pixel qualifies, or the shading is not finite.
///
/// ```
/// use relight_core::light::{Normals, Order, ShLight};
/// use relight_core::render::{DiffuseForm, DiffuseLayer, fit_light};
///
/// let normals = Normals::sphere(33);
/// let even = ShLight::even(Order::TWO, [0.2, 0.5, 1.0]);
/// let shading = DiffuseLayer::new(&even, DiffuseForm::Irradiance).shading(&normals);
/// let found = fit_light(&normals, &shading, &[true; 33 * 33], 0.0)?;
/// assert!((found.coefficients()[0][1] - even.coefficients()[0][1]).abs() < 1e-4);
/// # Ok::<(), relight_core::light::LightError>(())
/// ```
pub fn fit_light(
    normals: &Normals,
    shading: &Rgb<Linear>,
    mask: &[bool],
    stiffness: f64,
) -> Result<ShLight, LightError> {
    fit_light_near(
        &ShLight::dark(Order::TWO),
        normals,
        shading,
        mask,
        stiffness,
    )
}

/// The same, with bands 1 and 2 regularised towards those of the light `near`; only its bands 0 to 2 count.
///
/// # Errors
/// As [`fit_light`].
pub fn fit_light_near(
    near: &ShLight,
    normals: &Normals,
    shading: &Rgb<Linear>,
    mask: &[bool],
    stiffness: f64,
) -> Result<ShLight, LightError> {
    let near = near.with_order(Order::TWO);
    let mut equations = NormalEquations::new(Order::TWO.coefficients());
    let planes = normals.planes().planes();
    let colours = shading.planes().planes();
    for (at, _) in mask.iter().enumerate().filter(|(_, inside)| **inside) {
        let [x, y, z] = planes.map(|plane| f64::from(plane[at]));
        if let Some(normal) = Direction::new(x, y, z) {
            let terms = terms(normal.components());
            let mut rest = colours.map(|colour| f64::from(colour[at]));
            for (term, coefficient) in terms.iter().zip(near.coefficients()) {
                for (rest, coefficient) in rest.iter_mut().zip(coefficient) {
                    *rest -= term * coefficient;
                }
            }
            equations.add(&terms, rest);
        }
    }
    equations.add_ridge(0, RIDGE);
    equations.add_ridge(1, stiffness);
    let mut light = ShLight::new(equations.solve().ok_or(LightError::TooFewPixels)?)?;
    for (found, near) in light.coefficients_mut().iter_mut().zip(near.coefficients()) {
        for (found, near) in found.iter_mut().zip(near) {
            *found += near;
        }
    }
    Ok(light)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Extent, Planes};
    use crate::render::{DiffuseForm, DiffuseLayer};

    #[test]
    fn the_light_of_a_rendered_shading_is_found() {
        let coefficients = [9.0, 0.6, -0.5, 0.4, 0.3, -0.2, 0.5, 0.1, -0.4];
        let light = ShLight::new(coefficients.map(|c| [c, c / 2.0, c + 0.1]).to_vec()).unwrap();
        let normals = Normals::sphere(41);
        let shading = DiffuseLayer::new(&light, DiffuseForm::Irradiance).shading(&normals);
        let found = fit_light(&normals, &shading, &vec![true; 41 * 41], 0.0).unwrap();
        for (a, b) in found.coefficients().iter().zip(light.coefficients()) {
            for (a, b) in a.iter().zip(b) {
                assert!((a - b).abs() < 1e-3, "{a} {b}");
            }
        }
    }

    #[test]
    fn a_stiff_fit_keeps_the_shape_of_the_light_that_it_is_drawn_to() {
        let coefficients = [9.0, 0.6, -0.5, 0.4, 0.3, -0.2, 0.5, 0.1, -0.4];
        let near = ShLight::new(coefficients.map(|c| [c; 3]).to_vec()).unwrap();
        let normals = Normals::sphere(41);
        let shading = Rgb::new(Planes::filled(Extent::new(41, 41), [4.0; 3]));
        let mask = vec![true; 41 * 41];
        let found =
            |stiffness| fit_light_near(&near, &normals, &shading, &mask, stiffness).unwrap();
        let (stiff, free) = (found(1e9), found(0.0));
        for (at, coefficient) in coefficients.into_iter().enumerate().skip(1) {
            assert!((stiff.coefficients()[at][1] - coefficient).abs() < 1e-3);
            assert!(free.coefficients()[at][1].abs() < 1e-3);
        }
        let of_stiff = DiffuseLayer::new(&stiff, DiffuseForm::Irradiance).shading(&normals);
        let visible = 41.0 * 41.0 * std::f32::consts::PI / 4.0;
        let mean = of_stiff.planes().plane(0).iter().sum::<f32>() / visible;
        assert!((mean - 4.0).abs() < 0.1, "{mean}");
    }

    #[test]
    fn a_flat_surface_has_a_light_too() {
        let extent = Extent::new(4, 4);
        let normals = Normals::new(Planes::filled(extent, [0.0, 0.0, 1.0]));
        let shading = Rgb::new(Planes::filled(extent, [0.5, 0.25, 1.0]));
        let light = fit_light(&normals, &shading, &[true; 16], 0.0).unwrap();
        let again = DiffuseLayer::new(&light, DiffuseForm::Irradiance).shading(&normals);
        let [r, g, b] = again.planes().pixel(2, 2);
        assert!((r - 0.5).abs() < 1e-4 && (g - 0.25).abs() < 1e-4 && (b - 1.0).abs() < 1e-4);
    }

    #[test]
    fn stiffness_makes_light_smoother_and_not_darker() {
        let mut light = ShLight::even(Order::TWO, [1.0; 3]);
        light.coefficients_mut()[1] = [0.8; 3];
        let normals = Normals::sphere(41);
        let shading = DiffuseLayer::new(&light, DiffuseForm::Irradiance).shading(&normals);
        let fit =
            |stiffness| fit_light(&normals, &shading, &vec![true; 41 * 41], stiffness).unwrap();
        let [loose, stiff] = [0.0, 10.0].map(|stiffness| {
            let light = fit(stiffness);
            [0, 1].map(|at: usize| light.coefficients()[at][0])
        });
        assert!(stiff[1].abs() < 0.5 * loose[1]);
        assert!(
            (stiff[0] / loose[0] - 1.0).abs() < 0.2,
            "{stiff:?} {loose:?}"
        );
    }

    #[test]
    fn without_a_pixel_there_is_no_light() {
        let normals = Normals::sphere(9);
        let shading = Rgb::new(Planes::filled(normals.extent(), [1.0; 3]));
        let found = fit_light(&normals, &shading, &[false; 81], 0.0);
        assert_eq!(found, Err(LightError::TooFewPixels));
    }
}
