//! Rounded primitives blended into one another: a distance field, drawn at random.

use glam::{Mat3, Vec3};

use super::super::mesh::RawMesh;
use super::super::noise::Noise;
use super::super::random::Random;
use super::surface;

/// A primitive around the origin.
#[derive(Debug, Clone, Copy)]
enum Primitive {
    Ellipsoid {
        radii: Vec3,
    },
    RoundBox {
        half: Vec3,
        radius: f32,
    },
    Capsule {
        half_height: f32,
        radius: f32,
        taper: f32,
    },
    Torus {
        major: f32,
        minor: f32,
    },
    Cylinder {
        radius: f32,
        half_height: f32,
    },
}

/// A primitive in its place.
struct Part {
    primitive: Primitive,
    to_local: Mat3,
    centre: Vec3,
    scale: f32,
    is_hole: bool,
}

/// A distance field.
struct Blend {
    parts: Vec<Part>,
    /// Width of the seams between parts.
    softness: f32,
    is_mirrored: bool,
    /// Radians of turn about y along each unit of height.
    twist: f32,
    bumps: Vec<(Noise, f32)>,
    /// Half the thickness of the wall, where only a wall is left.
    shell: Option<f32>,
    /// A plane: what lies beyond is cut away.
    cut: Option<(Vec3, f32)>,
}

/// The surface of a random blend.
pub(super) fn draw(random: &mut Random) -> RawMesh {
    let blend = Blend::draw(random);
    surface::surface_of(|point| blend.distance(point))
}

impl Blend {
    fn draw(random: &mut Random) -> Self {
        let parts = (0..random.count(1..10))
            .map(|k| Part::draw(random, k == 0))
            .collect();
        let softness = random.pick([0.01, 0.04, 0.1, 0.2]);
        let is_mirrored = random.chance(0.4);
        let twist = if random.chance(0.2) {
            random.normal() * 0.6
        } else {
            0.0
        };
        let octaves = if random.chance(0.5) {
            random.count(1..4)
        } else {
            0
        };
        let bumps = [3.0, 7.0, 14.0].into_iter().take(octaves).map(|frequency| {
            let height = random.uniform(0.0..0.35) / frequency;
            (Noise::new(random.seed(), frequency), height)
        });
        let bumps = bumps.collect();
        let shell = random.chance(0.15).then(|| random.uniform(0.03..0.06));
        let cut = random
            .chance(0.2)
            .then(|| (random.direction(), random.uniform(0.0..0.45)));
        Self {
            parts,
            softness,
            is_mirrored,
            twist,
            bumps,
            shell,
            cut,
        }
    }

    fn distance(&self, point: Vec3) -> f32 {
        let mut bent = point;
        if self.is_mirrored {
            bent.x = bent.x.abs();
        }
        if self.twist != 0.0 {
            bent = Mat3::from_rotation_y(self.twist * bent.y) * bent;
        }
        let mut distance = self.parts.iter().fold(f32::INFINITY, |sum, part| {
            let own = part.distance(bent);
            if part.is_hole {
                -soft_minimum(-sum, own, self.softness)
            } else {
                soft_minimum(sum, own, self.softness)
            }
        });
        // Far from the surface bumps change nothing.
        if distance.abs() < 0.4 {
            distance += self
                .bumps
                .iter()
                .map(|(noise, height)| noise.at(bent) * height)
                .sum::<f32>();
        }
        if let Some(half) = self.shell {
            distance = (distance + half).abs() - half;
        }
        match self.cut {
            Some((normal, offset)) => distance.max(point.dot(normal) - offset),
            None => distance,
        }
    }
}

/// The lesser of the two, rounded where they are alike (Quilez's polynomial blend).
fn soft_minimum(a: f32, b: f32, width: f32) -> f32 {
    if !a.is_finite() {
        return if a > 0.0 { b } else { a };
    }
    let part = (0.5 + 0.5 * (b - a) / width).clamp(0.0, 1.0);
    b + (a - b) * part - width * part * (1.0 - part)
}

impl Part {
    fn draw(random: &mut Random, is_first: bool) -> Self {
        let to_local = if random.chance(0.7) {
            random.rotation()
        } else {
            Mat3::IDENTITY
        };
        Self {
            primitive: Primitive::draw(random),
            to_local,
            centre: random.in_box(if is_first { 0.15 } else { 0.55 }),
            scale: if is_first {
                1.0
            } else {
                random.uniform(0.35..0.9)
            },
            is_hole: !is_first && random.chance(0.12),
        }
    }

    fn distance(&self, point: Vec3) -> f32 {
        let local = self.to_local * (point - self.centre) / self.scale;
        self.primitive.distance(local) * self.scale
    }
}

impl Primitive {
    fn draw(random: &mut Random) -> Self {
        let mut side = |range: std::ops::Range<f32>| random.uniform(range);
        let three = |side: &mut dyn FnMut(std::ops::Range<f32>) -> f32, low, high| {
            Vec3::new(side(low..high), side(low..high), side(low..high))
        };
        match (side(0.0..5.0)) as u32 {
            0 => Self::Ellipsoid {
                radii: three(&mut side, 0.18, 0.6),
            },
            1 => Self::RoundBox {
                half: three(&mut side, 0.12, 0.45),
                radius: side(0.005..0.1),
            },
            2 => Self::Capsule {
                half_height: side(0.2..0.7),
                radius: side(0.06..0.22),
                taper: side(-0.5..0.5),
            },
            3 => Self::Torus {
                major: side(0.25..0.55),
                minor: side(0.06..0.18),
            },
            _ => Self::Cylinder {
                radius: side(0.1..0.45),
                half_height: side(0.1..0.5),
            },
        }
    }

    fn distance(self, p: Vec3) -> f32 {
        match self {
            Self::Ellipsoid { radii } => ((p / radii).length() - 1.0) * radii.min_element(),
            Self::RoundBox { half, radius } => {
                let beyond = p.abs() - half;
                beyond.max(Vec3::ZERO).length() + beyond.max_element().min(0.0) - radius
            }
            Self::Capsule {
                half_height,
                radius,
                taper,
            } => {
                let y = p.y.clamp(-half_height, half_height);
                (p - Vec3::Y * y).length() - radius * (1.0 + taper * y / half_height)
            }
            Self::Torus { major, minor } => {
                let ring = p.x.hypot(p.z) - major;
                ring.hypot(p.y) - minor
            }
            Self::Cylinder {
                radius,
                half_height,
            } => {
                let (side, end) = (p.x.hypot(p.z) - radius, p.y.abs() - half_height);
                side.max(end).min(0.0) + side.max(0.0).hypot(end.max(0.0)) - 0.02
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_soft_minimum_is_the_minimum_away_from_the_seam() {
        assert!((soft_minimum(0.1, 0.9, 0.2) - 0.1).abs() < 1e-6);
        assert!(soft_minimum(0.3, 0.3, 0.2) < 0.3);
        assert_eq!(soft_minimum(f32::INFINITY, 0.4, 0.2), 0.4);
    }

    #[test]
    fn a_hole_takes_away_from_what_is_there() {
        let part = |radius: f32, is_hole| Part {
            primitive: Primitive::Ellipsoid {
                radii: Vec3::splat(radius),
            },
            to_local: Mat3::IDENTITY,
            centre: Vec3::ZERO,
            scale: 1.0,
            is_hole,
        };
        let blend = Blend {
            parts: vec![part(0.6, false), part(0.3, true)],
            softness: 0.01,
            is_mirrored: false,
            twist: 0.0,
            bumps: Vec::new(),
            shell: None,
            cut: None,
        };
        assert!(blend.distance(Vec3::ZERO) > 0.2);
        assert!(blend.distance(Vec3::X * 0.45) < -0.1);
        assert!(blend.distance(Vec3::X * 0.8) > 0.1);
    }
}
