//! Objects out of nothing but a seed: blends of primitives with bumps, turned bodies and cups, boxes,
//! crumpled sheets, and the two plain bodies that have analytic answers. Knows meshes only.

mod blend;
mod boxes;
mod lathe;
mod sheet;
mod surface;

use serde::{Deserialize, Serialize};

use super::mesh::{CREASE, Mesh, RawMesh};
use super::random::Random;

/// A kind of procedural object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ShapeKind {
    /// One to nine rounded primitives, blended into one another, with bumps, twists, shells, cuts.
    Blend,
    /// A solid of revolution: vases, cups with walls and handles, cylinders.
    Lathe,
    /// Boxes, piled or hollow: flat faces, sharp edges, dark insides.
    Boxes,
    /// A sheet with folds or waves.
    Sheet,
    /// A ball of fine facets.
    Sphere,
    /// A square in one plane.
    Plane,
}

impl ShapeKind {
    /// The kinds of random objects, each with its weight: what trained best.
    pub(super) const WEIGHTS: [(Self, f32); 4] = [
        (Self::Blend, 0.62),
        (Self::Lathe, 0.15),
        (Self::Boxes, 0.10),
        (Self::Sheet, 0.13),
    ];

    /// The kind's name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Blend => "blend",
            Self::Lathe => "lathe",
            Self::Boxes => "boxes",
            Self::Sheet => "sheet",
            Self::Sphere => "sphere",
            Self::Plane => "plane",
        }
    }

    /// Whether the object is seen from one side only.
    pub(super) fn is_open(self) -> bool {
        matches!(self, Self::Sheet | Self::Plane)
    }

    /// The object of this kind and seed. The same seed always gives the same object.
    pub fn build(self, seed: u64) -> Mesh {
        let mut random = Random::new(seed);
        // A draw may leave nothing (a cut may take all): the next one is as good.
        loop {
            let (raw, crease) = self.draw(&mut random);
            if let Ok(mesh) = Mesh::new(raw, crease) {
                return mesh;
            }
        }
    }

    fn draw(self, random: &mut Random) -> (RawMesh, f32) {
        match self {
            Self::Blend => (blend::draw(random), CREASE),
            Self::Lathe => (lathe::draw(random), 0.8),
            Self::Boxes => (boxes::draw(random), 0.1),
            Self::Sheet => (sheet::draw(random), 0.35),
            Self::Sphere => (sphere(), CREASE),
            Self::Plane => (sheet::flat(), CREASE),
        }
    }
}

/// A ball of 32 768 facets: a cube whose faces are grids, blown up.
fn sphere() -> RawMesh {
    const CELLS: u32 = 52;
    let mut raw = RawMesh::default();
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            // Even angles rather than even lengths; exactly 1 at the seams.
            let even = |t: f32| {
                let tangent = (t * std::f32::consts::FRAC_PI_4).tan();
                if t.abs() < 1.0 { tangent } else { t }
            };
            let place = |u: f32, v: f32| {
                let mut p = [0.0; 3];
                p[axis] = sign;
                p[(axis + 1) % 3] = even(u * sign);
                p[(axis + 2) % 3] = even(v);
                glam::Vec3::from_array(p).normalize()
            };
            surface::add_grid(&mut raw, CELLS, CELLS, place);
        }
    }
    raw
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [ShapeKind; 6] = [
        ShapeKind::Blend,
        ShapeKind::Lathe,
        ShapeKind::Boxes,
        ShapeKind::Sheet,
        ShapeKind::Sphere,
        ShapeKind::Plane,
    ];

    #[test]
    fn a_seed_gives_one_object_and_another_seed_another() {
        for kind in ShapeKind::WEIGHTS.map(|(kind, _)| kind) {
            let [a, b, c] = [1, 1, 2].map(|seed| kind.build(seed));
            assert_eq!(&a.positions, &b.positions, "{kind:?}");
            assert_ne!(&a.positions, &c.positions, "{kind:?}");
        }
    }

    #[test]
    fn every_kind_has_triangles_within_the_unit_sphere_and_unit_normals() {
        for kind in ALL {
            for seed in 0..6 {
                let mesh = kind.build(seed);
                assert!(mesh.triangles.len() >= 2, "{kind:?} {seed}");
                let mut lengths = mesh.positions.iter().map(|p| p.length());
                assert!(lengths.all(|length| length <= 1.0001), "{kind:?} {seed}");
                let mut normals = mesh.normals.iter().flatten();
                assert!(
                    normals.all(|n| (n.length() - 1.0).abs() < 1e-4),
                    "{kind:?} {seed}"
                );
            }
        }
    }

    #[test]
    fn closed_objects_show_their_outside() {
        // By the divergence theorem, the volume is positive where triangles face outwards.
        for kind in [
            ShapeKind::Blend,
            ShapeKind::Lathe,
            ShapeKind::Boxes,
            ShapeKind::Sphere,
        ] {
            for seed in 0..8 {
                let mesh = kind.build(seed);
                let volume: f32 = mesh
                    .triangles
                    .iter()
                    .map(|corners| {
                        let [a, b, c] = corners.map(|v| mesh.positions[v as usize]);
                        a.dot(b.cross(c)) / 6.0
                    })
                    .sum();
                assert!(volume > 0.0, "{kind:?} {seed}: {volume}");
            }
        }
    }

    #[test]
    fn the_ball_is_round() {
        let ball = ShapeKind::Sphere.build(0);
        for (corners, normals) in ball.triangles.iter().zip(&ball.normals) {
            for (&vertex, normal) in corners.iter().zip(normals) {
                let position = ball.positions[vertex as usize];
                assert!((position.length() - 1.0).abs() < 1e-5);
                assert!(normal.dot(position) > 0.99998);
            }
        }
    }
}
