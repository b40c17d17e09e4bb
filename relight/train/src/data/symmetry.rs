//! The eight symmetries of a square picture, by which a sample is seen in eight ways.

use std::ops::Neg;

/// One of them: the picture's axes are swapped, then each is turned over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Symmetry {
    /// Whether rows become columns; of square pictures only.
    pub transposed: bool,
    /// Whether left becomes right.
    pub mirrored: bool,
    /// Whether up becomes down.
    pub upside_down: bool,
}

impl Symmetry {
    /// The one numbered by the lowest three bits.
    pub(crate) fn from_bits(bits: u64) -> Self {
        Self {
            mirrored: bits & 1 == 1,
            upside_down: bits & 2 == 2,
            transposed: bits & 4 == 4,
        }
    }

    /// From which component of a normal its component `axis` comes (0: to the right, 1: up, 2: to the viewer), and with
    /// which sign.
    pub(crate) fn component(self, axis: usize) -> (usize, f32) {
        let sign = |turned_over: bool| if turned_over { -1.0 } else { 1.0 };
        match (axis, self.transposed) {
            (0, false) => (0, sign(self.mirrored)),
            (1, false) => (1, sign(self.upside_down)),
            // Rows run down, normals point up.
            (0, true) => (1, -sign(self.upside_down)),
            (1, true) => (0, -sign(self.mirrored)),
            _ => (axis, 1.0),
        }
    }

    /// The nine coefficients of order 2 of a light on what is seen.
    pub(crate) fn light<N: Copy + Neg<Output = N>>(self, of: [N; 9]) -> [N; 9] {
        // Where the coefficients of x and y are, and of x z and y z.
        const BAND_1: [usize; 2] = [3, 1];
        const BAND_2: [usize; 2] = [7, 5];
        let signed = |value: N, sign: f32| if sign < 0.0 { -value } else { value };
        let [x, y] = [self.component(0), self.component(1)];
        let mut seen = of;
        for places in [BAND_1, BAND_2] {
            seen[places[0]] = signed(of[places[x.0]], x.1);
            seen[places[1]] = signed(of[places[y.0]], y.1);
        }
        seen[4] = signed(of[4], x.1 * y.1);
        if self.transposed {
            seen[8] = -of[8];
        }
        seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::image::{Extent, Planes};
    use relight_core::light::{Normals, ShLight};
    use relight_core::render::{DiffuseForm, DiffuseLayer};

    const SIDE: usize = 9;

    impl Symmetry {
        /// Which pixel of the picture is seen at a place.
        pub(crate) fn source(self, extent: Extent, x: usize, y: usize) -> usize {
            let (mut u, mut v) = if self.transposed { (y, x) } else { (x, y) };
            if self.mirrored {
                u = extent.width - 1 - u;
            }
            if self.upside_down {
                v = extent.height - 1 - v;
            }
            v * extent.width + u
        }
    }

    /// Heights of a surface that has no symmetry of its own.
    fn height(x: f32, y: f32) -> f32 {
        0.3 * x + 0.11 * x * y - 0.2 * y + 0.05 * x * x
    }

    /// The slopes to the right and up at a pixel of a picture of heights.
    fn slopes(heights: &[f32], x: usize, y: usize) -> [f32; 2] {
        let at = |x: usize, y: usize| heights[y * SIDE + x];
        [at(x + 1, y) - at(x - 1, y), at(x, y - 1) - at(x, y + 1)]
    }

    #[test]
    fn normals_are_those_of_the_surface_as_it_is_seen() {
        let extent = Extent::new(SIDE, SIDE);
        let heights: Vec<f32> = (0..SIDE * SIDE)
            .map(|at| height((at % SIDE) as f32, (at / SIDE) as f32))
            .collect();
        for bits in 0..8 {
            let symmetry = Symmetry::from_bits(bits);
            let place = |at: usize| symmetry.source(extent, at % SIDE, at / SIDE);
            let seen: Vec<f32> = (0..SIDE * SIDE).map(|at| heights[place(at)]).collect();
            for (x, y) in [(2, 3), (4, 4), (6, 2)] {
                let source = symmetry.source(extent, x, y);
                let own = slopes(&heights, source % SIDE, source / SIDE);
                let found = slopes(&seen, x, y);
                for (axis, found) in found.into_iter().enumerate() {
                    let (from, sign) = symmetry.component(axis);
                    assert!((sign * own[from] - found).abs() < 1e-5, "{symmetry:?}");
                }
            }
            let mut places: Vec<usize> = (0..SIDE * SIDE).map(place).collect();
            places.sort_unstable();
            places.dedup();
            assert_eq!(places.len(), SIDE * SIDE);
        }
    }

    #[test]
    fn light_is_as_bright_on_a_normal_as_it_was_before_both_were_turned() {
        let coefficients = [1.0, 0.4, 0.3, 0.5, 0.1, -0.1, 0.05, 0.2, 0.15];
        let irradiance = |coefficients: [f64; 9], normal: [f32; 3]| {
            let light = ShLight::new(coefficients.map(|c| [c; 3]).to_vec()).unwrap();
            let normals = Normals::new(Planes::filled(Extent::new(1, 1), normal));
            let layer = DiffuseLayer::new(&light, DiffuseForm::Irradiance);
            layer.shading(&normals).planes().plane(0)[0]
        };
        for bits in 0..8 {
            let symmetry = Symmetry::from_bits(bits);
            for normal in [[0.6, 0.8, 0.0], [-0.48, 0.64, 0.6], [0.0, -0.6, 0.8]] {
                let seen = [0, 1, 2].map(|axis| {
                    let (from, sign) = symmetry.component(axis);
                    sign * normal[from]
                });
                let (own, turned) = (
                    irradiance(coefficients, normal),
                    irradiance(symmetry.light(coefficients), seen),
                );
                assert!((own - turned).abs() < 1e-5, "{symmetry:?}: {own} {turned}");
            }
        }
    }

    #[test]
    fn eight_numbers_are_eight_symmetries() {
        let all: Vec<Symmetry> = (0..8).map(Symmetry::from_bits).collect();
        for (at, one) in all.iter().enumerate() {
            assert!(!all[..at].contains(one));
        }
        assert_eq!(all[0], Symmetry::default());
    }
}
