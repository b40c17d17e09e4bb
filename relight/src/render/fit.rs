//! The light of order 2 that explains a shading best: what the paper's representation can hold.

use std::array::from_fn;

use crate::image::{Linear, Rgb};
use crate::light::{Direction, LightError, Normals, Order, ShLight, YUp, basis};

const COUNT: usize = Order::TWO.coefficients();
/// The integrals of the cosine lobe over the bands 0, 1 and 2.
const LOBE: [f64; 3] = {
    let pi = std::f64::consts::PI;
    [pi, 2.0 * pi / 3.0, pi / 4.0]
};
/// Added to the diagonal, relative to its mean, so that few or equal normals have a solution too.
const RIDGE: f64 = 1e-9;

/// The light of order 2 whose irradiance on the normals is nearest to the shading, by least squares
/// over the pixels where `mask` is true and a normal is known.
///
/// `stiffness`, 0 or more, draws the bands 1 and 2 towards none: it is added to the diagonal of the
/// normal equations, relative to its mean. 0 gives the best fit; 1e-3 keeps light that the normals hardly
/// tell, such as that from behind, small.
///
/// ```
/// use relight::light::{Normals, Order, ShLight};
/// use relight::render::{DiffuseForm, DiffuseLayer, fit_light};
///
/// let sky = ShLight::even(Order::TWO, [1.0; 3]);
/// let normals = Normals::sphere(9);
/// let shading = DiffuseLayer::new(&sky, DiffuseForm::Irradiance).shading(&normals);
/// let found = fit_light(&normals, &shading, &[true; 81], 0.0)?;
/// assert!((found.coefficients()[0][1] - sky.coefficients()[0][1]).abs() < 1e-5);
/// # Ok::<(), relight::light::LightError>(())
/// ```
///
/// # Errors
/// [`LightError::NotFinite`] where the shading holds values that are not finite.
pub fn fit_light(
    normals: &Normals<YUp>,
    shading: &Rgb<Linear>,
    mask: &[bool],
    stiffness: f64,
) -> Result<ShLight, LightError> {
    let mut matrix = [[0.0; COUNT]; COUNT];
    let mut right = [[0.0; 3]; COUNT];
    let [x, y, z] = normals.planes().planes();
    let colours = shading.planes().planes();
    for (at, _) in mask.iter().enumerate().filter(|(_, inside)| **inside) {
        let [x, y, z] = [x, y, z].map(|plane| f64::from(plane[at]));
        let Some(normal) = Direction::new(x, y, z) else {
            continue;
        };
        let terms = terms(normal);
        for (row, a) in terms.iter().enumerate() {
            for (cell, b) in matrix[row].iter_mut().zip(terms) {
                *cell += a * b;
            }
            for (cell, colour) in right[row].iter_mut().zip(colours) {
                *cell += a * f64::from(colour[at]);
            }
        }
    }
    let trace: f64 = (0..COUNT).map(|at| matrix[at][at]).sum();
    for (at, row) in matrix.iter_mut().enumerate() {
        let stiffness = if at == 0 { 0.0 } else { stiffness };
        row[at] += (trace / COUNT as f64 * (RIDGE + stiffness)).max(f64::MIN_POSITIVE);
    }
    ShLight::new(solve(matrix, right).to_vec())
}

/// The irradiance on a normal of light with each coefficient alone.
fn terms(normal: Direction) -> [f64; COUNT] {
    let values = basis(Order::TWO, normal);
    std::array::from_fn(|at| LOBE[at.isqrt()] * values[at])
}

/// The solution of a system with a positive definite matrix, by Cholesky's factors.
fn solve(mut matrix: [[f64; COUNT]; COUNT], mut right: [[f64; 3]; COUNT]) -> [[f64; 3]; COUNT] {
    for row in 0..COUNT {
        for column in 0..=row {
            let products: f64 = (0..column)
                .map(|k| matrix[row][k] * matrix[column][k])
                .sum();
            let left = matrix[row][column] - products;
            matrix[row][column] = if row == column {
                left.max(f64::MIN_POSITIVE).sqrt()
            } else {
                left / matrix[column][column]
            };
        }
    }
    for row in 0..COUNT {
        let known = weighted_sum(&right, (0..row).map(|k| (k, matrix[row][k])));
        right[row] = from_fn(|c| (right[row][c] - known[c]) / matrix[row][row]);
    }
    for row in (0..COUNT).rev() {
        let known = weighted_sum(&right, (row + 1..COUNT).map(|k| (k, matrix[k][row])));
        right[row] = from_fn(|c| (right[row][c] - known[c]) / matrix[row][row]);
    }
    right
}

/// The sum of some rows, each times its weight.
fn weighted_sum(rows: &[[f64; 3]; COUNT], weights: impl Iterator<Item = (usize, f64)>) -> [f64; 3] {
    weights.fold([0.0; 3], |sum, (row, weight)| {
        from_fn(|c| sum[c] + weight * rows[row][c])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Extent, Planes};
    use crate::render::{DiffuseForm, DiffuseLayer};

    #[test]
    fn the_light_of_a_rendered_shading_is_found() {
        let light = ShLight::new(
            (0..9)
                .map(|at| {
                    [
                        2.0 - 0.2 * f64::from(at),
                        1.5,
                        0.3 * f64::from(at % 3) + 2.0,
                    ]
                })
                .map(|[r, g, b]| [r, g * 0.1, b])
                .enumerate()
                .map(|(at, rgb)| {
                    if at == 0 {
                        [9.0; 3]
                    } else {
                        rgb.map(|v| v * 0.3)
                    }
                })
                .collect(),
        )
        .unwrap();
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
    fn a_flat_surface_has_a_light_too() {
        let extent = Extent::new(4, 4);
        let normals = Normals::new(Planes::filled(extent, [0.0, 0.0, 1.0]));
        let shading = Rgb::new(Planes::filled(extent, [0.5, 0.25, 1.0]));
        let light = fit_light(&normals, &shading, &[true; 16], 0.0).unwrap();
        let again = DiffuseLayer::new(&light, DiffuseForm::Irradiance).shading(&normals);
        let [r, g, b] = again.planes().pixel(2, 2);
        assert!((r - 0.5).abs() < 1e-4 && (g - 0.25).abs() < 1e-4 && (b - 1.0).abs() < 1e-4);
    }
}
