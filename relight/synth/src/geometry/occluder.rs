//! What blocks light.

use std::time::Duration;

use glam::{Affine3A, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;

use crate::mesh::Mesh;

/// Triangles in the viewer's frame, ready to be asked whether they block a ray.
pub(crate) struct Occluder {
    tree: CwBvh,
    /// In the order of the tree's leaves.
    triangles: Vec<Triangle>,
    /// Which of them are the plate's.
    is_plate: Vec<bool>,
}

/// What a ray meets first.
pub(crate) struct Hit {
    /// The unit normal of the object's facet, on the ray's side; none of the plate, which is black.
    pub(crate) normal: Option<Vec3>,
}

impl Occluder {
    /// The mesh in its place.
    pub(crate) fn new(mesh: &Mesh, placement: Affine3A) -> Self {
        Self::from_triangles(triangles(mesh, placement), usize::MAX)
    }

    /// The mesh in its place together with a disc (a turntable's plate) that is not seen.
    pub(crate) fn with_disc(mesh: &Mesh, placement: Affine3A, disc: &Disc) -> Self {
        let mut all = triangles(mesh, placement);
        let plate = all.len();
        all.extend(disc.triangles());
        Self::from_triangles(all, plate)
    }

    /// The triangles from the number `plate` on are the plate's.
    fn from_triangles(triangles: Vec<Triangle>, plate: usize) -> Self {
        let mut unused = Duration::ZERO;
        let tree = build_cwbvh_from_tris(&triangles, BvhBuildParams::fast_build(), &mut unused);
        let order = || tree.primitive_indices.iter().map(|&index| index as usize);
        let is_plate = order().map(|index| index >= plate).collect();
        let triangles = order().map(|index| triangles[index]).collect();
        Self {
            tree,
            triangles,
            is_plate,
        }
    }

    /// What a ray from a point in a direction (of unit length) meets first.
    pub(crate) fn first_hit(&self, from: Vec3, direction: Vec3) -> Option<Hit> {
        let ray = Ray::new(
            Vec3A::from(from),
            Vec3A::from(direction),
            0.0,
            f32::INFINITY,
        );
        let mut hit = RayHit::none();
        let is_hit = self
            .tree
            .ray_traverse(ray, &mut hit, |ray, at| self.triangles[at].intersect(ray));
        is_hit.then(|| {
            let at = hit.primitive_id as usize;
            let normal = Vec3::from(self.triangles[at].compute_normal());
            let side = if normal.dot(direction) > 0.0 {
                -1.0
            } else {
                1.0
            };
            Hit {
                normal: (!self.is_plate[at]).then_some(normal * side),
            }
        })
    }

    /// Whether anything blocks a ray from a point in a direction (of unit length)
    /// up to a distance.
    pub(crate) fn blocks(&self, from: Vec3, direction: Vec3, distance: f32) -> bool {
        let ray = Ray::new(Vec3A::from(from), Vec3A::from(direction), 0.0, distance);
        !self
            .tree
            .ray_traverse_miss(ray, |ray, at| self.triangles[at].intersect(ray))
    }
}

/// A flat round plate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Disc {
    pub(crate) centre: Vec3,
    /// Its upper side's unit normal.
    pub(crate) normal: Vec3,
    pub(crate) radius: f32,
}

impl Disc {
    fn triangles(&self) -> impl Iterator<Item = Triangle> {
        const CORNERS: usize = 48;
        let (right, up) = self.normal.any_orthonormal_pair();
        let rim = (0..=CORNERS).map(move |k| {
            let (sin, cos) = (std::f32::consts::TAU * k as f32 / CORNERS as f32).sin_cos();
            self.centre + (right * cos + up * sin) * self.radius
        });
        let rim: Vec<Vec3A> = rim.map(Vec3A::from).collect();
        let centre = Vec3A::from(self.centre);
        let fan: Vec<Triangle> = rim
            .windows(2)
            .map(|pair| Triangle {
                v0: centre,
                v1: pair[0],
                v2: pair[1],
            })
            .collect();
        fan.into_iter()
    }
}

fn triangles(mesh: &Mesh, placement: Affine3A) -> Vec<Triangle> {
    let place = |vertex: u32| {
        let position = mesh.positions[vertex as usize];
        placement.transform_point3a(Vec3A::from(position))
    };
    let corners = mesh.triangles.iter();
    corners
        .map(|corners| {
            let [v0, v1, v2] = corners.map(place);
            Triangle { v0, v1, v2 }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::shape::ShapeKind;

    #[test]
    fn rays_are_blocked_by_a_ball_where_geometry_says_so() {
        let ball = Occluder::new(&ShapeKind::Sphere.build(0), Affine3A::IDENTITY);
        let mut random = Random::new(4);
        let mut blocked = 0;
        for _ in 0..5000 {
            let (from, direction) = (random.direction() * 3.0, random.direction());
            let along = -from.dot(direction);
            let passes_at = (from + direction * along).length();
            if (passes_at - 1.0).abs() < 0.01 {
                continue;
            }
            let hits = along > 0.0 && passes_at < 1.0;
            assert_eq!(ball.blocks(from, direction, f32::INFINITY), hits);
            assert!(!ball.blocks(from, direction, 1.9));
            blocked += usize::from(hits);
        }
        assert!(blocked > 50);
    }

    #[test]
    fn a_plate_blocks_what_comes_from_below() {
        let disc = Disc {
            centre: Vec3::new(0.0, -1.2, 0.0),
            normal: Vec3::Y,
            radius: 2.0,
        };
        let scene = Occluder::with_disc(&ShapeKind::Sphere.build(0), Affine3A::IDENTITY, &disc);
        let side = Vec3::new(1.5, 0.0, 0.0);
        assert!(scene.blocks(side, Vec3::NEG_Y, f32::INFINITY));
        assert!(!scene.blocks(side, Vec3::Y, f32::INFINITY));
        assert!(!scene.blocks(side * 2.0, Vec3::NEG_Y, f32::INFINITY));
    }
}
