//! Polygons as triangles.

use earcut::Earcut;
use glam::{DVec3, Vec3};

/// Part of a polygon's squared area by which a triangle may face backwards by rounding and still be flat.
const FLAT: f64 = 1e-9;

/// Cuts polygons into triangles. Reused for many of them, since it keeps its memory.
pub(super) struct Triangulator {
    earcut: Earcut<f64>,
    ears: Vec<usize>,
}

impl Triangulator {
    pub(super) fn new() -> Self {
        Self {
            earcut: Earcut::new(),
            ears: Vec::new(),
        }
    }

    /// The triangles of a polygon by its corners' numbers, all turning as the polygon does: a fan about the first corner
    /// if that covers it, as for every convex one; else ears clipped on the polygon's plane.
    pub(super) fn triangles(&mut self, corners: &[Vec3]) -> Vec<[usize; 3]> {
        let fan = (2..corners.len()).map(|k| [0, k - 1, k]);
        let normal = normal(corners);
        // Also where the corners are not finite, or enclose no area.
        let Some(axis) = dominant(normal).filter(|_| corners.len() > 3) else {
            return fan.collect();
        };
        let facing = |[a, b, c]: [usize; 3]| {
            let [a, b, c] = [a, b, c].map(|at| corners[at].as_dvec3());
            (b - a).cross(c - a).dot(normal)
        };
        let least = -FLAT * normal.length_squared();
        if fan.clone().all(|triangle| facing(triangle) >= least) {
            return fan.collect();
        }
        let flat = corners.iter().map(|corner| {
            let place = corner.as_dvec3().to_array();
            [place[(axis + 1) % 3], place[(axis + 2) % 3]]
        });
        self.earcut.earcut(flat, &[], &mut self.ears);
        let (ears, _) = self.ears.as_chunks();
        let turned = |&[a, b, c]: &[usize; 3]| {
            if facing([a, b, c]) < 0.0 {
                [a, c, b]
            } else {
                [a, b, c]
            }
        };
        match ears {
            [] => fan.collect(),
            ears => ears.iter().map(turned).collect(),
        }
    }
}

/// Twice the area of a polygon, along its normal (Newell's method).
fn normal(corners: &[Vec3]) -> DVec3 {
    let Some(first) = corners.first() else {
        return DVec3::ZERO;
    };
    let first = first.as_dvec3();
    let sides = corners.windows(2);
    sides
        .map(|side| (side[0].as_dvec3() - first).cross(side[1].as_dvec3() - first))
        .sum()
}

/// The longest axis of a direction; `None` for one without a finite length.
fn dominant(direction: DVec3) -> Option<usize> {
    let length = direction.length_squared();
    (length.is_finite() && length > 0.0).then(|| direction.abs().max_position())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn area(corners: &[Vec3], triangles: &[[usize; 3]]) -> f64 {
        let normal = normal(corners).normalize();
        let twice = triangles.iter().map(|triangle| {
            let [a, b, c] = triangle.map(|at| corners[at].as_dvec3());
            let twice = (b - a).cross(c - a).dot(normal);
            assert!(twice >= 0.0, "a triangle faces the other way");
            twice
        });
        0.5 * twice.sum::<f64>()
    }

    /// In a plane that leans.
    fn leaning(flat: &[(f32, f32)]) -> Vec<Vec3> {
        let along = |&(x, y): &(f32, f32)| Vec3::new(x, y + 0.5 * x, 0.3 * y - x);
        flat.iter().map(along).collect()
    }

    #[test]
    fn concave_polygons_are_filled_from_whichever_corner_they_start() {
        let shapes: [&[(f32, f32)]; 4] = [
            // An L, an arrow of four corners, a comb, and a frame whose hole is reached by a cut that is passed twice.
            &[(0., 0.), (3., 0.), (3., 1.), (1., 1.), (1., 3.), (0., 3.)],
            &[(0., 0.), (2., 1.), (0., 2.), (0.5, 1.)],
            &[
                (0., 0.),
                (5., 0.),
                (5., 3.),
                (4., 3.),
                (4., 1.),
                (3., 1.),
                (3., 3.),
                (2., 3.),
                (2., 1.),
                (1., 1.),
                (1., 3.),
                (0., 3.),
            ],
            &[
                (0., 0.),
                (3., 0.),
                (3., 3.),
                (0., 3.),
                (0., 0.),
                (1., 1.),
                (1., 2.),
                (2., 2.),
                (2., 1.),
                (1., 1.),
            ],
        ];
        let mut triangulator = Triangulator::new();
        for shape in shapes {
            for start in 0..shape.len() {
                for reversed in [false, true] {
                    let mut shape = shape.to_vec();
                    shape.rotate_left(start);
                    if reversed {
                        shape.reverse();
                    }
                    let corners = leaning(&shape);
                    let found = triangulator.triangles(&corners);
                    let right = 0.5 * normal(&corners).length();
                    assert!((area(&corners, &found) - right).abs() < 1e-5, "{shape:?}");
                }
            }
        }
    }

    #[test]
    fn convex_polygons_are_fans_about_their_first_corner() {
        let corners = leaning(&[(0., 0.), (2., 0.), (3., 1.), (2., 2.), (0., 2.)]);
        let fan = [[0, 1, 2], [0, 2, 3], [0, 3, 4]];
        assert_eq!(Triangulator::new().triangles(&corners), fan);
        // Also with a corner in the middle of a side, and where the corners are not quite in one plane.
        let mut corners = leaning(&[(0., 0.), (1., 0.), (2., 0.), (2., 2.), (0., 2.)]);
        corners[3].z += 0.1;
        assert_eq!(Triangulator::new().triangles(&corners), fan);
    }

    proptest! {
        #[test]
        fn no_polygon_ends_the_program(
            corners in prop::collection::vec(
                prop::array::uniform3(prop_oneof![
                    (-2_i8..3).prop_map(f32::from),
                    any::<f32>(),
                ]),
                0..120,
            )
        ) {
            let corners: Vec<Vec3> = corners.into_iter().map(Vec3::from).collect();
            let found = Triangulator::new().triangles(&corners);
            prop_assert!(found.iter().flatten().all(|&at| at < corners.len()));
        }

        #[test]
        fn no_flat_polygon_ends_the_program(
            corners in prop::collection::vec((-3_i8..4, -3_i8..4), 0..200)
        ) {
            let flat: Vec<(f32, f32)> =
                corners.iter().map(|&(x, y)| (f32::from(x), f32::from(y))).collect();
            Triangulator::new().triangles(&leaning(&flat));
        }
    }
}
