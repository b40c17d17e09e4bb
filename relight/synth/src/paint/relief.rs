//! Relief that is finer than the mesh: fur, scales, wrinkles. Normals lean with the slope of noise.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::super::geometry::{GBuffer, turned_to};
use super::super::noise::Noise;
use super::super::random::Random;
use super::frame::step;

/// A height field on the surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Relief {
    octaves: Vec<Octave>,
    /// Where there is relief, if not everywhere.
    patches: Option<Octave>,
    /// Factors along the object's axes, 1 at most: fibres are longer than wide.
    stretch: Vec3,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Octave {
    seed: u64,
    frequency: f32,
    /// About the mean slope that it makes.
    slope: f32,
    is_ridged: bool,
}

impl Relief {
    pub(crate) fn draw(random: &mut Random) -> Self {
        let count = random.count(1..4);
        let total = random.uniform(0.08..0.6);
        let octaves = (0..count).map(|_| Octave {
            seed: random.seed(),
            frequency: random.log_uniform(5.0..40.0),
            slope: total * random.uniform(0.3..1.0) / count as f32,
            is_ridged: random.chance(0.4),
        });
        let octaves = octaves.collect();
        let is_stretched = random.chance(0.5);
        let stretch = if is_stretched {
            let factors = Vec3::from_array([(); 3].map(|()| random.uniform(-1.0..1.0).exp()));
            factors / factors.max_element()
        } else {
            Vec3::ONE
        };
        let patches = random.chance(0.35).then(|| Octave {
            seed: random.seed(),
            frequency: random.uniform(1.0..3.0),
            slope: 0.0,
            is_ridged: false,
        });
        Self {
            octaves,
            patches,
            stretch,
        }
    }

    /// The normals of what a buffer shows, leaned by the relief; they never face away from the eye.
    pub(crate) fn apply(&self, buffer: &GBuffer) -> Vec<Vec3> {
        let to_viewer = buffer.gradient_map;
        let seen = buffer.object_points.iter().zip(&buffer.normals);
        let seen = seen.zip(&buffer.towards_eye);
        seen.map(|((&point, &normal), &towards_eye)| {
            let slope = to_viewer * self.slope(point);
            let along = slope - normal * slope.dot(normal);
            turned_to((normal - along).normalize_or(normal), towards_eye)
        })
        .collect()
    }

    /// The gradient of the height, in the object's own frame.
    fn slope(&self, point: Vec3) -> Vec3 {
        let stretched = point * self.stretch;
        let slopes = self.octaves.iter().map(|octave| octave.slope(stretched));
        let sum = slopes.sum::<Vec3>() * self.stretch;
        match &self.patches {
            Some(patches) => sum * step(Noise::new(patches.seed, patches.frequency).at(point), 0.3),
            None => sum,
        }
    }
}

impl Octave {
    fn slope(&self, point: Vec3) -> Vec3 {
        let noise = Noise::new(self.seed, self.frequency).sloped(point);
        let side = if self.is_ridged && noise.value < 0.0 {
            -1.0
        } else {
            1.0
        };
        noise.gradient * (side * self.slope / self.frequency)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::ShapeKind;
    use crate::view::{Pose, Projection};

    /// Normals of a plane with the slopes of the height field.
    #[test]
    fn normals_lean_against_the_slope_of_the_height() {
        let mesh = ShapeKind::Plane.build(0);
        let pose = Pose::upright(0.3, 0.2, 0.9);
        let placement = pose.place(&mesh, Projection::Orthographic);
        let buffer = GBuffer::render(&mesh, placement, Projection::Orthographic, 64);
        let octave = |seed, frequency, is_ridged| Octave {
            seed,
            frequency,
            slope: 0.2,
            is_ridged,
        };
        let relief = Relief {
            octaves: vec![octave(1, 4.0, false), octave(2, 9.0, true)],
            patches: None,
            stretch: Vec3::new(1.0, 0.5, 0.8),
        };
        let height = |point: Vec3| {
            let heights = relief.octaves.iter().map(|octave| {
                let noise = Noise::new(octave.seed, octave.frequency);
                let value = noise.at(point * relief.stretch);
                let value = if octave.is_ridged { value.abs() } else { value };
                value * octave.slope / octave.frequency
            });
            heights.sum::<f32>()
        };
        let leaned = relief.apply(&buffer);
        let mut right = 0;
        for (k, leaned) in leaned.iter().enumerate() {
            let (point, normal) = (buffer.object_points[k], buffer.normals[k]);
            // Tangents of the surface that stands out of the plane by the height.
            let is_right = [Vec3::X, Vec3::Y].iter().all(|&axis| {
                let step = 2e-3;
                let rise = height(point + axis * step) - height(point - axis * step);
                let tangent = pose.turn * axis + normal * rise / (2.0 * step);
                tangent.normalize().dot(*leaned).abs() < 0.01
            });
            right += usize::from(is_right);
        }
        // At the ridges differences do not tell the slope.
        assert!(
            right * 100 > buffer.len() * 95,
            "{right} of {}",
            buffer.len()
        );
        assert!(
            leaned
                .iter()
                .zip(&buffer.normals)
                .any(|(a, b)| a.dot(*b) < 0.98)
        );
    }

    #[test]
    fn leaned_normals_are_unit_vectors_that_never_face_away() {
        let mesh = ShapeKind::Blend.build(4);
        let projection = Projection::Perspective { distance: 4.0 };
        let placement = Pose::upright(0.2, 0.2, 0.9).place(&mesh, projection);
        let buffer = GBuffer::render(&mesh, placement, projection, 64);
        let mut random = Random::new(5);
        for _ in 0..5 {
            let leaned = Relief::draw(&mut random).apply(&buffer);
            assert_ne!(leaned, buffer.normals);
            for (normal, towards_eye) in leaned.iter().zip(&buffer.towards_eye) {
                assert!((normal.length() - 1.0).abs() < 1e-4);
                assert!(normal.dot(*towards_eye) > -1e-4);
            }
        }
    }
}
