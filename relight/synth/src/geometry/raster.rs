//! Which triangle is seen at each pixel: a z-buffer.

use glam::{DVec3, Vec2};

/// No triangle.
pub(super) const NOTHING: u32 = u32::MAX;

/// A vertex in the picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Projected {
    /// In pixels from the upper left corner; pixel (x, y) has its centre at (x + 0.5, y + 0.5).
    pub(super) place: Vec2,
    /// Larger is nearer; linear over a triangle's picture.
    pub(super) nearness: f32,
}

/// Where a pixel's centre lies in a triangle: weights of the corners as they appear in the picture,
/// which add up to 1.
pub(super) type Weights = [f32; 3];

/// The foremost triangle at each pixel of a square picture of `size` pixels, [`NOTHING`] where there is
/// none. Neighbours leave no gap between them.
pub(super) fn nearest_triangles(
    size: u32,
    vertices: &[Projected],
    triangles: &[[u32; 3]],
) -> Vec<u32> {
    let side = size as usize;
    let mut seen = vec![NOTHING; side * side];
    let mut nearest = vec![f32::NEG_INFINITY; side * side];
    for (number, &corners) in (0_u32..).zip(triangles) {
        let Some(triangle) = Triangle::new(corners, vertices) else {
            continue;
        };
        let [columns, rows] = triangle.span(side);
        for row in rows {
            for column in columns.clone() {
                let Some(weights) = triangle.weights(column, row) else {
                    continue;
                };
                let nearness = triangle.nearness(weights);
                let at = row * side + column;
                if nearness > nearest[at] {
                    nearest[at] = nearness;
                    seen[at] = number;
                }
            }
        }
    }
    seen
}

/// A triangle in the picture, prepared for looking up pixels.
pub(super) struct Triangle {
    corners: [Projected; 3],
    /// For each corner, the line through the other two: positive on the triangle's side.
    lines: [DVec3; 3],
    area: f64,
}

impl Triangle {
    /// `None` if its picture has no area.
    pub(super) fn new(corners: [u32; 3], vertices: &[Projected]) -> Option<Self> {
        let places = corners.map(|v| vertices[v as usize]);
        let lines = [0, 1, 2].map(|k| {
            let (from, to) = ((k + 1) % 3, (k + 2) % 3);
            // Two triangles that share an edge compute the same line, so that they leave no gap.
            if corners[from] < corners[to] {
                line(places[from].place, places[to].place)
            } else {
                -line(places[to].place, places[from].place)
            }
        });
        let area = lines[0].dot(homogeneous(places[0].place));
        let is_thin = !area.is_finite() || area.abs() < 1e-12;
        (!is_thin).then(|| Self {
            corners: places,
            lines: lines.map(|line| line * area.signum()),
            area: area.abs(),
        })
    }

    /// The pixels whose centres may lie in the triangle.
    fn span(&self, side: usize) -> [std::ops::Range<usize>; 2] {
        let places = self.corners.map(|corner| corner.place);
        let low = places[0].min(places[1]).min(places[2]) - 0.5;
        let high = places[0].max(places[1]).max(places[2]) - 0.5;
        let range = |low: f32, high: f32| {
            let first = low.ceil().max(0.0) as usize;
            let end = (high.floor() + 1.0).clamp(0.0, side as f32) as usize;
            first..end
        };
        [range(low.x, high.x), range(low.y, high.y)]
    }

    /// The weights at a pixel's centre; `None` if it lies outside.
    pub(super) fn weights(&self, column: usize, row: usize) -> Option<Weights> {
        let centre = DVec3::new(column as f64 + 0.5, row as f64 + 0.5, 1.0);
        let parts = self.lines.map(|line| line.dot(centre));
        let is_inside = parts.iter().all(|&part| part >= 0.0);
        is_inside.then(|| parts.map(|part| (part / self.area) as f32))
    }

    fn nearness(&self, weights: Weights) -> f32 {
        let [a, b, c] = [0, 1, 2].map(|k| weights[k] * self.corners[k].nearness);
        a + b + c
    }
}

fn homogeneous(place: Vec2) -> DVec3 {
    DVec3::new(f64::from(place.x), f64::from(place.y), 1.0)
}

/// The line through two points, as coefficients of x, y and 1.
fn line(from: Vec2, to: Vec2) -> DVec3 {
    homogeneous(from).cross(homogeneous(to))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn vertex(x: f32, y: f32, nearness: f32) -> Projected {
        Projected {
            place: Vec2::new(x, y),
            nearness,
        }
    }

    #[test]
    fn of_two_triangles_the_nearer_is_seen() {
        let vertices = [
            vertex(0.0, 0.0, 1.0),
            vertex(8.0, 0.0, 1.0),
            vertex(0.0, 8.0, 1.0),
            vertex(0.0, 0.0, 0.0),
            vertex(8.0, 0.0, 2.5),
            vertex(0.0, 8.0, 0.0),
        ];
        let seen = nearest_triangles(8, &vertices, &[[0, 1, 2], [3, 4, 5]]);
        assert_eq!(seen[0], 0);
        assert_eq!(seen[6], 1);
        assert_eq!(seen[8 * 7 + 7], NOTHING);
    }

    #[test]
    fn a_fan_of_random_triangles_covers_its_square_without_a_gap() {
        let mut random = Random::new(11);
        for _ in 0..20 {
            let centre = vertex(random.uniform(1.0..31.0), random.uniform(1.0..31.0), 0.0);
            let rim = [(0.0, 0.0), (32.0, 0.0), (32.0, 32.0), (0.0, 32.0)];
            let mut vertices: Vec<Projected> =
                rim.iter().map(|&(x, y)| vertex(x, y, 0.0)).collect();
            vertices.push(centre);
            let triangles = [[0, 1, 4], [2, 1, 4], [4, 2, 3], [3, 0, 4]];
            let seen = nearest_triangles(32, &vertices, &triangles);
            assert!(seen.iter().all(|&triangle| triangle != NOTHING));
        }
    }

    #[test]
    fn triangles_outside_the_picture_or_without_an_area_draw_nothing() {
        let vertices = [
            vertex(-5.0, -5.0, 0.0),
            vertex(-1.0, 1e9, 0.0),
            vertex(-3.0, 2.0, 0.0),
            vertex(f32::INFINITY, 0.0, 0.0),
        ];
        let seen = nearest_triangles(4, &vertices, &[[0, 1, 2], [0, 0, 2], [0, 1, 3]]);
        assert!(seen.iter().all(|&triangle| triangle == NOTHING));
    }
}
