//! The colour of a plain background at each pixel: a polynomial of the position for each channel.

use crate::bitmap::Bitmap;

/// A colour as the file has it, 0 to 255.
pub(super) type Colour = [f32; 3];

/// A smooth surface of colours over an image, whose positions are brought to -1 to 1.
#[derive(Debug, Clone)]
pub(super) struct Surface {
    degree: usize,
    coefficients: Vec<[f64; 3]>,
}

impl Surface {
    /// Fits the surface to the chosen pixels of an image by least squares; `None` if they do not determine it.
    pub(super) fn fit(
        colours: &[Colour],
        chosen: &Bitmap,
        (width, height): (usize, usize),
        degree: usize,
    ) -> Option<Self> {
        let terms = terms(degree);
        // The upper part of the normal equations, and their right sides.
        let mut matrix = vec![vec![0.0; terms]; terms];
        let mut right = vec![[0.0; 3]; terms];
        for (at, _) in chosen.bits().iter().enumerate().filter(|&(_, &bit)| bit) {
            let basis = basis(at, (width, height), degree);
            for (row, &value) in basis.iter().enumerate() {
                for (column, &other) in basis.iter().enumerate() {
                    matrix[row][column] += value * other;
                }
                for (sum, colour) in right[row].iter_mut().zip(colours[at]) {
                    *sum += value * f64::from(colour);
                }
            }
        }
        let coefficients = solve(matrix, right)?;
        Some(Self {
            degree,
            coefficients,
        })
    }

    /// The colour of the surface at each pixel.
    pub(super) fn colours(&self, size: (usize, usize)) -> Vec<Colour> {
        let colour = |at| {
            let basis = basis(at, size, self.degree);
            let mut sum = [0.0; 3];
            for (value, coefficients) in basis.iter().zip(&self.coefficients) {
                for (sum, coefficient) in sum.iter_mut().zip(coefficients) {
                    *sum += value * coefficient;
                }
            }
            sum.map(|value| value as f32)
        };
        (0..size.0 * size.1).map(colour).collect()
    }
}

/// Largest difference of a channel of two colours.
pub(super) fn difference(a: Colour, b: Colour) -> f32 {
    let channels = a.iter().zip(b);
    channels.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// How many monomials of two variables there are up to a degree.
fn terms(degree: usize) -> usize {
    (degree + 1) * (degree + 2) / 2
}

/// The monomials up to a degree at a pixel.
fn basis(at: usize, (width, height): (usize, usize), degree: usize) -> Vec<f64> {
    let place = |at: usize, size: usize| (at as f64 + 0.5) / size as f64 * 2.0 - 1.0;
    let (x, y) = (place(at % width, width), place(at / width, height));
    let mut basis = Vec::with_capacity(terms(degree));
    let mut power = 1.0;
    for i in 0..=degree {
        let mut value = power;
        for _ in 0..=degree - i {
            basis.push(value);
            value *= y;
        }
        power *= x;
    }
    basis
}

/// Solves linear equations by Gaussian elimination; `None` if they are singular.
fn solve(mut matrix: Vec<Vec<f64>>, mut right: Vec<[f64; 3]>) -> Option<Vec<[f64; 3]>> {
    let size = right.len();
    for column in 0..size {
        let largest = |&row: &usize| matrix[row][column].abs();
        let pivot = (column..size).max_by(|a, b| largest(a).total_cmp(&largest(b)))?;
        if largest(&pivot) < 1e-9 {
            return None;
        }
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        let (pivot_row, pivot_right) = (matrix[column].clone(), right[column]);
        for row in (0..size).filter(|&row| row != column) {
            let factor = matrix[row][column] / pivot_row[column];
            for (value, pivot) in matrix[row].iter_mut().zip(&pivot_row) {
                *value -= factor * pivot;
            }
            for (value, pivot) in right[row].iter_mut().zip(pivot_right) {
                *value -= factor * pivot;
            }
        }
    }
    let rows = right.iter().enumerate();
    Some(
        rows.map(|(row, right)| right.map(|value| value / matrix[row][row]))
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_graded_background_is_continued_into_the_middle() {
        let size = (40, 30);
        let truth = |at: usize| {
            let (x, y) = ((at % 40) as f32, (at / 40) as f32);
            [
                50.0 + x + 0.02 * y * y,
                80.0 - 0.5 * y,
                200.0 - 0.03 * x * y,
            ]
        };
        let colours: Vec<Colour> = (0..1200).map(truth).collect();
        let ring = Bitmap::new((40, 30), (0..1200).map(|at| at % 40 < 3 || at / 40 < 3));
        let surface = Surface::fit(&colours, &ring, size, 2).unwrap();
        let found = surface.colours(size);
        let apart = found.iter().zip(&colours).map(|(a, b)| difference(*a, *b));
        assert!(apart.fold(0.0, f32::max) < 0.01);
    }

    #[test]
    fn too_few_pixels_determine_no_surface() {
        let one = Bitmap::new((4, 4), (0..16).map(|at| at == 5));
        assert!(Surface::fit(&[[9.0; 3]; 16], &one, (4, 4), 2).is_none());
    }
}
