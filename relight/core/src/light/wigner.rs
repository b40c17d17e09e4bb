//! Rotation of coefficients by Wigner matrices of the real spherical harmonics.

use super::{Rotation, ShLight};

impl ShLight {
    /// The light after a rotation: light from d comes from the rotated d.
    ///
    /// Ivanic and Ruedenberg, *Rotation Matrices for Real Spherical Harmonics*, J. Phys. Chem. 100 (1996),
    /// with their correction of 1998: the matrix of band l follows from those of bands 1 and l - 1.
    ///
    /// ```
    /// use relight_core::light::{Direction, Order, Rotation, ShLight};
    ///
    /// let mut light = ShLight::dark(Order::TWO);
    /// light.coefficients_mut()[2] = [1.0; 3]; // Y_1^0, from the viewer
    /// let turn = Rotation::about(Direction::UP, 0.4);
    /// let turned = light.rotated(&turn);
    /// let from = turn.apply(Direction::VIEWER);
    /// assert!((turned.radiance(from)[0] - light.radiance(Direction::VIEWER)[0]).abs() < 1e-12);
    /// ```
    pub fn rotated(&self, rotation: &Rotation) -> Self {
        let mut bands = vec![Band::zeroth()];
        if self.order().get() >= 1 {
            bands.push(Band::first(rotation));
        }
        for l in 2..=self.order().get() {
            let next = Band::after(&bands[l - 1], &bands[1]);
            bands.push(next);
        }
        let mut turned = self.clone();
        for (l, band) in bands.iter().enumerate() {
            let range = l * l..(l + 1) * (l + 1);
            let from = &self.coefficients()[range.clone()];
            for (row, to) in turned.coefficients_mut()[range].iter_mut().enumerate() {
                *to = band.row_times(row, from);
            }
        }
        turned
    }
}

/// The matrix of one band, with rows and columns -l to l.
#[derive(Debug, Clone)]
struct Band {
    l: i32,
    cells: Vec<f64>,
}

impl Band {
    fn zeroth() -> Self {
        Self {
            l: 0,
            cells: vec![1.0],
        }
    }

    /// Band 1 is the rotation itself, in the order y, z, x.
    fn first(rotation: &Rotation) -> Self {
        let axes = [1, 2, 0];
        let matrix = rotation.matrix();
        let cells = axes
            .iter()
            .flat_map(|&row| axes.map(|column| matrix[row][column]));
        Self {
            l: 1,
            cells: cells.collect(),
        }
    }

    fn after(last: &Self, first: &Self) -> Self {
        let l = last.l + 1;
        let step = Step { l, last, first };
        let cells = (-l..=l).flat_map(|m| (-l..=l).map(move |n| (m, n)));
        Self {
            l,
            cells: cells.map(|(m, n)| step.cell(m, n)).collect(),
        }
    }

    fn at(&self, m: i32, n: i32) -> f64 {
        let side = 2 * self.l + 1;
        self.cells[((m + self.l) * side + n + self.l) as usize]
    }

    fn row_times(&self, row: usize, vector: &[[f64; 3]]) -> [f64; 3] {
        let side = vector.len();
        let mut sum = [0.0; 3];
        for (cell, value) in self.cells[row * side..(row + 1) * side].iter().zip(vector) {
            for (sum, v) in sum.iter_mut().zip(value) {
                *sum += cell * v;
            }
        }
        sum
    }
}

/// The recurrence to band l, in the letters of the article.
struct Step<'a> {
    l: i32,
    last: &'a Band,
    first: &'a Band,
}

impl Step<'_> {
    fn cell(&self, m: i32, n: i32) -> f64 {
        let l = self.l;
        let below = if n.abs() == l {
            2 * l * (2 * l - 1)
        } else {
            (l + n) * (l - n)
        };
        let root = |above: i32| (f64::from(above) / f64::from(below)).sqrt();
        let size = m.abs();
        let mut sum = 0.0;
        // Where a factor is 0, what it is multiplied with is not defined.
        if size < l {
            sum += root((l + m) * (l - m)) * self.p(0, m, n);
        }
        if m == 0 {
            sum -= 0.5 * root(2 * (l - 1) * l) * self.v(m, n);
        } else {
            sum += 0.5 * root((l + size - 1) * (l + size)) * self.v(m, n);
            if size < l - 1 {
                sum -= 0.5 * root((l - size - 1) * (l - size)) * self.w(m, n);
            }
        }
        sum
    }

    fn v(&self, m: i32, n: i32) -> f64 {
        let sqrt2 = 2.0_f64.sqrt();
        match m {
            0 => self.p(1, 1, n) + self.p(-1, -1, n),
            1 => sqrt2 * self.p(1, 0, n),
            -1 => sqrt2 * self.p(-1, 0, n),
            m if m > 0 => self.p(1, m - 1, n) - self.p(-1, 1 - m, n),
            m => self.p(1, m + 1, n) + self.p(-1, -m - 1, n),
        }
    }

    fn w(&self, m: i32, n: i32) -> f64 {
        if m > 0 {
            self.p(1, m + 1, n) + self.p(-1, -m - 1, n)
        } else {
            self.p(1, m - 1, n) - self.p(-1, 1 - m, n)
        }
    }

    fn p(&self, i: i32, m: i32, n: i32) -> f64 {
        let (first, last, edge) = (self.first, self.last, self.l - 1);
        if n == self.l {
            first.at(i, 1) * last.at(m, edge) - first.at(i, -1) * last.at(m, -edge)
        } else if n == -self.l {
            first.at(i, 1) * last.at(m, -edge) + first.at(i, -1) * last.at(m, edge)
        } else {
            first.at(i, 0) * last.at(m, n)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Direction, Order};
    use super::*;
    use proptest::prelude::*;

    fn some_light(order: Order) -> ShLight {
        let wave = |i: usize| ((i * i) as f64 * 0.37).sin();
        let values = (0..order.coefficients()).map(|i| [wave(i), wave(i + 3), wave(i + 7)]);
        ShLight::new(values.collect()).unwrap()
    }

    proptest! {
        #[test]
        fn what_came_from_a_direction_comes_from_where_it_is_turned_to(
            axis in prop::array::uniform3(-1.0..1.0), angle in -7.0..7.0, polar in 0.0..3.1, azimuth in 0.0..6.3
        ) {
            let [x, y, z] = axis;
            prop_assume!(x * x + y * y + z * z > 0.01);
            let turn = Rotation::about(Direction::new(x, y, z).unwrap(), angle);
            let from = Direction::from_angles(polar, azimuth);
            let light = some_light(Order::new(9).unwrap());
            let [before, after] = [light.radiance(from), light.rotated(&turn).radiance(turn.apply(from))];
            for (a, b) in before.iter().zip(after) {
                prop_assert!((a - b).abs() < 1e-11, "{a} {b}");
            }
        }
    }

    #[test]
    fn the_highest_order_is_turned_without_loss() {
        let order = Order::new(Order::MAX).unwrap();
        let turn = Rotation::about(Direction::new(1.0, 2.0, -0.5).unwrap(), 2.0);
        let light = some_light(order);
        let back = light.rotated(&turn).rotated(&turn.inverse());
        for (a, b) in light.coefficients().iter().zip(back.coefficients()) {
            assert!((a[0] - b[0]).abs() < 1e-9);
        }
    }

    #[test]
    fn a_turn_about_the_pole_leaves_m_0_alone() {
        let turn = Rotation::about(Direction::VIEWER, 1.0);
        let light = some_light(Order::new(6).unwrap());
        let turned = light.rotated(&turn);
        for l in 0..=6 {
            let middle = l * (l + 1);
            let [a, b] = [&light, &turned].map(|light| light.coefficients()[middle][0]);
            assert!((a - b).abs() < 1e-12);
        }
    }
}
