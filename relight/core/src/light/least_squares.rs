//! Least squares with three right-hand sides: red, green and blue. Knows nothing of light.

/// Normal equations of a least-squares problem with three right-hand sides.
pub struct NormalEquations {
    unknowns: usize,
    /// The lower triangle, row by row, in a square.
    matrix: Vec<f64>,
    right: Vec<[f64; 3]>,
}

impl NormalEquations {
    /// No equations yet.
    pub fn new(unknowns: usize) -> Self {
        Self {
            unknowns,
            matrix: vec![0.0; unknowns * unknowns],
            right: vec![[0.0; 3]; unknowns],
        }
    }

    /// Adds one equation: `factors` times the unknowns is `value`.
    pub fn add(&mut self, factors: &[f64], value: [f64; 3]) {
        for (i, a) in factors.iter().enumerate() {
            let row = &mut self.matrix[i * self.unknowns..][..=i];
            for (cell, b) in row.iter_mut().zip(factors) {
                *cell += a * b;
            }
            for (right, v) in self.right[i].iter_mut().zip(value) {
                *right += a * v;
            }
        }
    }

    /// Adds equations by their sums of products: of factors `i` and `j <= i`, and of factor `i`
    /// and the value.
    pub fn add_sums(
        &mut self,
        product: impl Fn(usize, usize) -> f64,
        right: impl Fn(usize) -> [f64; 3],
    ) {
        for i in 0..self.unknowns {
            for j in 0..=i {
                self.matrix[i * self.unknowns + j] += product(i, j);
            }
            for (sum, value) in self.right[i].iter_mut().zip(right(i)) {
                *sum += value;
            }
        }
    }

    /// Draws the unknowns from `first` on towards 0, by `part` of the mean of the diagonal: with it, few
    /// or equal equations have a solution too.
    pub fn add_ridge(&mut self, first: usize, part: f64) {
        let n = self.unknowns;
        let trace: f64 = (0..n).map(|i| self.matrix[i * n + i]).sum();
        for i in first..n {
            self.matrix[i * n + i] += trace / n as f64 * part;
        }
    }

    /// The solution by Cholesky's decomposition; `None` if the matrix has no full rank.
    pub fn solve(mut self) -> Option<Vec<[f64; 3]>> {
        let n = self.unknowns;
        let largest = (0..n).map(|i| self.matrix[i * n + i]).fold(0.0, f64::max);
        for i in 0..n {
            for j in 0..=i {
                let dot: f64 = (0..j)
                    .map(|k| self.matrix[i * n + k] * self.matrix[j * n + k])
                    .sum();
                let rest = self.matrix[i * n + j] - dot;
                self.matrix[i * n + j] = if i > j {
                    rest / self.matrix[j * n + j]
                } else if rest > 1e-10 * largest {
                    rest.sqrt()
                } else {
                    return None;
                };
            }
        }
        let mut x = self.right;
        for i in 0..n {
            x[i] = substitute(
                &x,
                x[i],
                (0..i).map(|k| (k, self.matrix[i * n + k])),
                self.matrix[i * n + i],
            );
        }
        for i in (0..n).rev() {
            x[i] = substitute(
                &x,
                x[i],
                (i + 1..n).map(|k| (k, self.matrix[k * n + i])),
                self.matrix[i * n + i],
            );
        }
        Some(x)
    }
}

/// `(value - sum of factor * x[k]) / diagonal`
fn substitute(
    x: &[[f64; 3]],
    value: [f64; 3],
    factors: impl Iterator<Item = (usize, f64)>,
    diagonal: f64,
) -> [f64; 3] {
    let mut rest = value;
    for (k, factor) in factors {
        for (rest, v) in rest.iter_mut().zip(x[k]) {
            *rest -= factor * v;
        }
    }
    rest.map(|v| v / diagonal)
}
