//! The place of an object and of the camera. The frame is the viewer's: x to the right,
//! y up, z to the viewer; the picture's edges lie at -1 and 1 in the plane z = 0.

use glam::{Affine3A, Mat3, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::mesh::Mesh;
use super::random::Random;
use super::shape::ShapeKind;

/// How points become places in the picture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Projection {
    /// Along z: the viewer is far away.
    Orthographic,
    /// Through an eye on the z axis.
    Perspective {
        /// Of the eye from the origin; half the picture's width is 1. At least 2.
        distance: f32,
    },
}

impl Projection {
    /// Place in the picture, -1..=1, and how much larger things appear there than at z = 0.
    pub(crate) fn project(self, point: Vec3) -> (Vec2, f32) {
        let magnification = match self {
            Self::Orthographic => 1.0,
            Self::Perspective { distance } => distance / (distance - point.z).max(1e-3),
        };
        (point.truncate() * magnification, magnification)
    }

    /// The direction from a point to the eye.
    pub(crate) fn towards_eye(self, point: Vec3) -> Vec3 {
        match self {
            Self::Orthographic => Vec3::Z,
            Self::Perspective { distance } => (Vec3::Z * distance - point).normalize_or(Vec3::Z),
        }
    }
}

/// How an object stands before the camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Pose {
    /// The rotation, column by column, after a stretch.
    pub turn: Mat3,
    /// Factors along the object's own axes.
    pub stretch: Vec3,
    /// Part of the picture's side that the object's longer side takes, 0..=1.
    pub fill: f32,
    /// Where it stands in the room that is left, from -1 (left, low) to 1.
    pub shift: Vec2,
}

impl Pose {
    /// Upright and unstretched in the middle, seen from this many radians above the horizon and
    /// turned about its own vertical axis.
    pub(crate) fn upright(elevation: f32, azimuth: f32, fill: f32) -> Self {
        Self {
            turn: Mat3::from_rotation_x(elevation) * Mat3::from_rotation_y(azimuth),
            stretch: Vec3::ONE,
            fill,
            shift: Vec2::ZERO,
        }
    }

    /// A random pose for an object of a kind; meshes from files stand mostly upright.
    pub(crate) fn draw(random: &mut Random, kind: Option<ShapeKind>) -> Self {
        let turn = match kind {
            Some(kind) if kind.is_open() => facing(random),
            _ if random.chance(0.6) => upright(random),
            _ => random.rotation(),
        };
        let stretch = if random.chance(0.3) {
            Vec3::from_array([(); 3].map(|()| random.uniform(0.7..1.4)))
        } else {
            Vec3::ONE
        };
        Self {
            turn,
            stretch,
            fill: random.uniform(0.85..0.99),
            shift: Vec2::new(random.uniform(-1.0..1.0), random.uniform(-1.0..1.0)),
        }
    }

    /// The map from the mesh's own frame into the viewer's.
    pub(crate) fn place(&self, mesh: &Mesh, projection: Projection) -> Affine3A {
        let linear = self.turn * Mat3::from_diagonal(self.stretch);
        let turned: Vec<Vec3> = mesh.positions.iter().map(|&p| linear * p).collect();
        let (mut scale, mut offset) = (0.5, Vec3::ZERO);
        // The perspective of the framed object is another one than that of the unframed.
        for _ in 0..8 {
            let bounds = Bounds::from_points(&turned, |p| projection.project(p * scale + offset).0);
            let extent = bounds.high - bounds.low;
            let correction = 2.0 * self.fill / extent.max_element().max(1e-6);
            scale *= correction;
            let slack = (Vec2::ONE - extent * correction / 2.0).max(Vec2::ZERO) * 0.98;
            let middle = (bounds.low + bounds.high) / 2.0;
            let wanted = self.shift * slack;
            offset = (offset + (wanted - middle).extend(0.0)) * Vec3::new(1.0, 1.0, 0.0);
            if let Projection::Perspective { distance } = projection {
                // However it is framed, it stays before the eye.
                scale = scale.min(distance * 0.45);
            }
        }
        Affine3A::from_mat3_translation(linear * scale, offset)
    }
}

struct Bounds {
    low: Vec2,
    high: Vec2,
}

impl Bounds {
    fn from_points(points: &[Vec3], place: impl Fn(Vec3) -> Vec2) -> Self {
        let mut bounds = Self {
            low: Vec2::INFINITY,
            high: Vec2::NEG_INFINITY,
        };
        for &point in points {
            let at = place(point);
            bounds.low = bounds.low.min(at);
            bounds.high = bounds.high.max(at);
        }
        bounds
    }
}

/// As things stand on a table that is looked at from somewhat above.
fn upright(random: &mut Random) -> Mat3 {
    let degrees = std::f32::consts::PI / 180.0;
    let around = random.uniform(0.0..std::f32::consts::TAU);
    let elevation = random.uniform(-5.0..45.0) * degrees;
    let roll = random.normal() * 6.0 * degrees;
    Mat3::from_rotation_z(roll) * Mat3::from_rotation_x(elevation) * Mat3::from_rotation_y(around)
}

/// Any rotation that turns +z at most 53 degrees away from the viewer.
fn facing(random: &mut Random) -> Mat3 {
    loop {
        let turn = random.rotation();
        if turn.z_axis.z > 0.6 {
            return turn;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bounds(pose: &Pose, projection: Projection) -> Bounds {
        let mesh = ShapeKind::Lathe.build(3);
        let placement = pose.place(&mesh, projection);
        Bounds::from_points(&mesh.positions, |p| {
            projection.project(placement.transform_point3(p)).0
        })
    }

    #[test]
    fn an_object_fills_the_picture_as_it_was_told_and_stays_within() {
        let mut random = Random::new(1);
        let projections = [
            Projection::Orthographic,
            Projection::Perspective { distance: 3.0 },
            Projection::Perspective { distance: 8.0 },
        ];
        for projection in projections {
            for _ in 0..10 {
                let pose = Pose::draw(&mut random, None);
                let bounds = bounds(&pose, projection);
                let longest = (bounds.high - bounds.low).max_element();
                assert!(
                    (longest / 2.0 - pose.fill).abs() < 0.01,
                    "{projection:?} {longest}"
                );
                assert!(bounds.low.min_element() > -1.0 && bounds.high.max_element() < 1.0);
            }
        }
    }

    #[test]
    fn an_object_seen_from_above_shows_its_top() {
        let pose = Pose::upright(0.5, 0.0, 0.9);
        assert!((pose.turn * Vec3::Y).z > 0.4);
    }
}
