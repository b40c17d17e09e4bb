//! Consistent orientation of triangles: neighbours alike, and each part of a mesh outwards.
//!
//! Which side of a part is outside is voted for by rays, as in Takayama et al. 2014, "A simple method for correcting facet
//! orientations in polygon meshes based on ray casting": light comes to it from far away.

use std::collections::{HashMap, VecDeque};

use glam::Vec3;

use crate::geometry::Occluder;
use crate::mesh::{CREASE, Mesh, RawMesh};
use crate::random::Random;

/// Triangles of a part from which rays are cast, and rays to each side of them.
const TRIANGLES: usize = 24;
const RAYS: usize = 4;
/// How far from a triangle a ray starts, in parts of the mesh's radius.
const LIFT: f32 = 1e-3;
/// How many more rays must reach the back than the front before a part is turned.
const MARGIN: usize = 6;

impl RawMesh {
    /// Turns triangles so that neighbours face alike and each part faces outwards. Vertices are joined.
    ///
    /// # Errors
    /// If no triangle has an area.
    pub(crate) fn orient(&mut self) -> Result<(), String> {
        let parts = self.align();
        // A copy of the shape alone, in the unit sphere.
        let shape = Self {
            positions: self.positions.clone(),
            triangles: self.triangles.clone(),
            ..Self::default()
        };
        let shape = Mesh::new(shape, CREASE)?;
        let occluder = Occluder::new(&shape, glam::Affine3A::IDENTITY);
        let place = Placement::from_positions(&self.positions);
        for part in parts {
            if self.faces_inwards(&part, &occluder, &place) {
                part.iter().for_each(|&triangle| self.turn(triangle));
            }
        }
        Ok(())
    }

    /// The same triangle seen from behind, with all that its corners have.
    fn turn(&mut self, triangle: usize) {
        self.triangles[triangle].swap(1, 2);
        if let Some(corners) = self.texture.get_mut(triangle) {
            corners.swap(1, 2);
        }
        if let Some(corners) = self.colours.get_mut(triangle) {
            corners.swap(1, 2);
        }
    }

    /// Turns triangles that face another way than most of those that they hang together with by edges of two triangles.
    /// The parts that hang together, each by its triangles.
    fn align(&mut self) -> Vec<Vec<usize>> {
        let neighbours = self.neighbours();
        let mut is_turned: Vec<Option<bool>> = vec![None; self.triangles.len()];
        let mut parts = Vec::new();
        for first in 0..self.triangles.len() {
            if is_turned[first].is_some() {
                continue;
            }
            let mut part = Vec::new();
            let mut waiting = VecDeque::from([first]);
            is_turned[first] = Some(false);
            while let Some(triangle) = waiting.pop_front() {
                part.push(triangle);
                let own = is_turned[triangle].unwrap_or_default();
                for &(other, is_alike) in &neighbours[triangle] {
                    if is_turned[other].is_none() {
                        is_turned[other] = Some(own == is_alike);
                        waiting.push_back(other);
                    }
                }
            }
            let turned: Vec<usize> = part
                .iter()
                .copied()
                .filter(|&one| is_turned[one] == Some(true))
                .collect();
            if 2 * turned.len() > part.len() {
                let others = part.iter().filter(|&&one| is_turned[one] == Some(false));
                others.for_each(|&triangle| self.turn(triangle));
            } else {
                turned.iter().for_each(|&triangle| self.turn(triangle));
            }
            parts.push(part);
        }
        parts
    }

    /// For each triangle those that share an edge with it that no third one has, and whether they face alike.
    fn neighbours(&self) -> Vec<Vec<(usize, bool)>> {
        /// Triangles at an edge, and whether each runs along it upwards; more than two are counted only.
        #[derive(Default)]
        struct Edge {
            count: usize,
            triangles: [(usize, bool); 2],
        }
        let mut edges: HashMap<[u32; 2], Edge> = HashMap::with_capacity(2 * self.triangles.len());
        for (number, &[a, b, c]) in self.triangles.iter().enumerate() {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let edge = edges.entry([from.min(to), from.max(to)]).or_default();
                if let Some(place) = edge.triangles.get_mut(edge.count) {
                    *place = (number, from < to);
                }
                edge.count += 1;
            }
        }
        let mut neighbours = vec![Vec::new(); self.triangles.len()];
        for (number, &[a, b, c]) in self.triangles.iter().enumerate() {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let Some(edge) = edges.get(&[from.min(to), from.max(to)]) else {
                    continue;
                };
                let [first, second] = edge.triangles;
                if edge.count == 2 && first.0 != second.0 {
                    let other = if first.0 == number { second } else { first };
                    neighbours[number].push((other.0, first.1 != second.1));
                }
            }
        }
        neighbours
    }

    /// Whether more rays from far away meet the backs of a part than its fronts.
    fn faces_inwards(&self, part: &[usize], occluder: &Occluder, place: &Placement) -> bool {
        let mut random = Random::new(part.len() as u64);
        let (mut front, mut back) = (0, 0);
        let step = part.len().div_ceil(TRIANGLES).max(1);
        for &triangle in part.iter().step_by(step) {
            let [a, b, c] =
                self.triangles[triangle].map(|v| place.of_point(self.positions[v as usize]));
            let Some(normal) = (b - a).cross(c - a).try_normalize() else {
                continue;
            };
            let middle = (a + b + c) / 3.0;
            for (side, count) in [(normal, &mut front), (-normal, &mut back)] {
                let is_free = |_: &usize| {
                    let around = random.rotation() * Vec3::Z;
                    let towards = (side + 0.9 * around).normalize_or(side);
                    !occluder.blocks(middle + side * LIFT, towards, f32::INFINITY)
                };
                *count += (0..RAYS).filter(is_free).count();
            }
        }
        back > front + MARGIN.min(part.len())
    }
}

/// Where points lie in the unit sphere, as those of a [`Mesh`] do.
struct Placement {
    middle: Vec3,
    radius: f32,
}

impl Placement {
    fn from_positions(positions: &[Vec3]) -> Self {
        let low = positions.iter().copied().reduce(Vec3::min);
        let high = positions.iter().copied().reduce(Vec3::max);
        let middle = low.zip(high).map_or(Vec3::ZERO, |(l, h)| l * 0.5 + h * 0.5);
        let farthest = positions.iter().map(|&p| (p - middle).length());
        Self {
            middle,
            radius: farthest.fold(f32::MIN_POSITIVE, f32::max),
        }
    }

    fn of_point(&self, point: Vec3) -> Vec3 {
        (point - self.middle) / self.radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::ShapeKind;

    /// A ball. If `is_mixed`, every third triangle faces inwards, else all of them.
    fn ball(is_mixed: bool) -> RawMesh {
        let ball = ShapeKind::Sphere.build(0);
        let mut raw = RawMesh {
            positions: ball.positions,
            triangles: ball.triangles,
            ..RawMesh::default()
        };
        for triangle in 0..raw.triangles.len() {
            if !is_mixed || triangle % 3 == 0 {
                raw.turn(triangle);
            }
        }
        raw
    }

    fn faces_outwards(raw: &RawMesh, triangle: [u32; 3]) -> bool {
        let [a, b, c] = triangle.map(|v| raw.positions[v as usize]);
        (b - a).cross(c - a).dot(a) > 0.0
    }

    #[test]
    fn triangles_are_turned_as_their_neighbours_are_and_outwards() {
        for is_mixed in [false, true] {
            let mut raw = ball(is_mixed);
            raw.orient().unwrap();
            let mut all = raw.triangles.iter();
            assert!(all.all(|&triangle| faces_outwards(&raw, triangle)));
        }
    }

    #[test]
    fn the_inside_of_a_bowl_faces_its_opening() {
        // Two halves of balls, the inner one a part of its own, open at the top.
        let mut raw = RawMesh::default();
        for radius in [1.0, 0.9] {
            let first = raw.positions.len() as u32;
            let ball = ShapeKind::Sphere.build(0);
            let below = ball.triangles.iter().filter(|corners| {
                corners
                    .iter()
                    .all(|&v| ball.positions[v as usize].y <= 0.05)
            });
            raw.triangles
                .extend(below.map(|corners| corners.map(|v| v + first)));
            raw.positions
                .extend(ball.positions.iter().map(|&p| p * radius));
        }
        let mut raw = raw.welded().unwrap();
        raw.orient().unwrap();
        for &triangle in &raw.triangles {
            let is_outer = raw.positions[triangle[0] as usize].length() > 0.95;
            assert_eq!(faces_outwards(&raw, triangle), is_outer);
        }
    }
}
