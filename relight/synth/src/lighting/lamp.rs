//! Lamps: the directions of their light, and what blocks it.

use std::f32::consts::TAU;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::geometry::{GBuffer, Occluder};
use crate::random::{mix, stream, unit_of};
use crate::vectors::{direction, vector};
use relight_core::light::{Order, Rotation, ShLight, basis};

/// Most rays from a pixel to a lamp.
pub(super) const MAX_RAYS: u32 = 64;
/// Rays end this far before a lamp.
const BEFORE: f32 = 1e-3;

/// A lamp.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct SyntheticLamp {
    /// Where it is.
    pub emitter: Emitter,
    /// Irradiance at the origin of a surface that faces the lamp.
    pub irradiance: Vec3,
    /// Rays from a pixel, 1..=64: with 1 its shadows are sharp.
    pub rays: u32,
}

/// Where a lamp's light comes from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Emitter {
    /// From far away.
    Distant {
        /// To the lamp, unit length.
        towards: Vec3,
        /// Half of the angle under which it is seen, radians, below 1.
        half_angle: f32,
    },
    /// A round area that faces the origin and gives off light as paper does.
    Disc {
        /// Its middle; the object is about 2 large and lies around the origin.
        centre: Vec3,
        /// Its radius.
        radius: f32,
    },
}

/// A ray from a pixel to a lamp.
#[derive(Debug, Clone, Copy)]
pub(super) struct LampRay {
    /// Unit length.
    pub(super) towards: Vec3,
    pub(super) distance: f32,
    /// Irradiance of a surface that faces along the ray, as a part of the lamp's.
    pub(super) strength: f32,
}

/// Which of a lamp's rays arrive: bit k of each covered pixel is that of ray k.
#[derive(Debug, Clone)]
pub(crate) struct LampShadows {
    open: Vec<u64>,
}

impl SyntheticLamp {
    /// The rays from a point; `turn`, 0..1, shifts them from pixel to pixel so that shadows have no
    /// steps.
    pub(super) fn rays_from(
        &self,
        point: Vec3,
        turn: f32,
    ) -> impl Iterator<Item = LampRay> + use<> {
        let (emitter, count) = (self.emitter, self.rays.clamp(1, MAX_RAYS));
        let aim = self.emitter.towards();
        let (right, up) = aim.any_orthonormal_pair();
        (0..count).map(move |number| {
            let (x, y) = disc_point(number, count, turn);
            emitter.ray(point, aim, right * x + up * y)
        })
    }

    /// Whose rays arrive at the pixels of a buffer. Rays from below the horizon of the mesh's own
    /// normal never do.
    pub(crate) fn shadows(&self, buffer: &GBuffer, occluder: &Occluder, seed: u64) -> LampShadows {
        let open = (0..buffer.len()).map(|k| {
            let rays = self.rays_from(buffer.points[k], turn(seed, buffer.pixels[k]));
            let (normal, start) = (buffer.normals[k], buffer.ray_starts[k]);
            rays.enumerate().fold(0, |bits, (number, ray)| {
                let arrives = normal.dot(ray.towards) > 0.0
                    && !occluder.blocks(start, ray.towards, ray.distance);
                bits | u64::from(arrives) << number
            })
        });
        LampShadows {
            open: open.collect(),
        }
    }

    /// The lamp, as all light from its middle.
    pub(crate) fn coefficients(&self, order: Order) -> ShLight {
        let values = basis(order, direction(self.emitter.towards()));
        let colour = self.irradiance.to_array().map(f64::from);
        let mut light = ShLight::dark(order);
        for (coefficient, value) in light.coefficients_mut().iter_mut().zip(values) {
            *coefficient = colour.map(|c| c * value);
        }
        light
    }

    /// The lamp, turned about the origin.
    pub(crate) fn turned(&self, turn: &Rotation) -> Self {
        let moved = |v: Vec3| vector(turn.apply(direction(v))) * v.length();
        Self {
            emitter: self.emitter.at(moved),
            ..*self
        }
    }
}

impl Emitter {
    /// From the origin to its middle, unit length.
    pub(super) fn towards(self) -> Vec3 {
        match self {
            Self::Distant { towards, .. } => towards.normalize_or(Vec3::Z),
            Self::Disc { centre, .. } => centre.normalize_or(Vec3::Z),
        }
    }

    /// The same, at least as high as 9 degrees over the horizon of this vertical.
    pub(crate) fn above(self, vertical: Vec3) -> Self {
        let raised = |place: Vec3| {
            let length = place.length();
            let height = place.dot(vertical);
            let level = place - vertical * height;
            let least = 0.16 * level.length();
            (level + vertical * height.abs().max(least)).normalize_or(vertical) * length
        };
        self.at(raised)
    }

    /// Its centre; `far` is the distance for distant lamps.
    pub(crate) fn middle(self, far: f32) -> Vec3 {
        match self {
            Self::Distant { .. } => self.towards() * far,
            Self::Disc { centre, .. } => centre,
        }
    }

    /// Half of the angle under which it is seen from the origin, radians.
    pub(crate) fn half_angle(self) -> f32 {
        match self {
            Self::Distant { half_angle, .. } => half_angle,
            Self::Disc { centre, radius } => (radius / centre.length().max(1e-3)).atan(),
        }
    }

    /// The same with its place or direction changed.
    fn at(self, changed: impl Fn(Vec3) -> Vec3) -> Self {
        match self {
            Self::Distant {
                towards,
                half_angle,
            } => Self::Distant {
                towards: changed(towards),
                half_angle,
            },
            Self::Disc { centre, radius } => Self::Disc {
                centre: changed(centre),
                radius,
            },
        }
    }

    /// The ray to the place `offset` (of length 0..=1) of the lamp, at right angles to `aim`.
    fn ray(self, point: Vec3, aim: Vec3, offset: Vec3) -> LampRay {
        match self {
            Self::Distant { half_angle, .. } => LampRay {
                towards: (aim + offset * half_angle.clamp(0.0, 1.0).tan()).normalize_or(aim),
                distance: f32::INFINITY,
                strength: 1.0,
            },
            Self::Disc { centre, radius } => {
                let way = centre + offset * radius - point;
                let square = way.length_squared().max(1e-6);
                let towards = way / square.sqrt();
                LampRay {
                    towards,
                    distance: (square.sqrt() - BEFORE).max(0.0),
                    strength: towards.dot(aim).max(0.0) * centre.length_squared() / square,
                }
            }
        }
    }
}

impl LampShadows {
    /// The part of a lamp's rays that arrive at a covered pixel.
    pub(crate) fn visible_part(&self, pixel: usize, lamp: &SyntheticLamp) -> f32 {
        self.open[pixel].count_ones() as f32 / lamp.rays.clamp(1, MAX_RAYS) as f32
    }

    /// Whether a ray arrives at a covered pixel.
    pub(super) fn arrives(&self, pixel: usize, ray: usize) -> bool {
        self.open[pixel] >> ray & 1 == 1
    }
}

/// By how much the rays of a pixel are turned, 0..1.
pub(super) fn turn(seed: u64, pixel: u32) -> f32 {
    unit_of(mix(stream(seed, u64::from(pixel))))
}

/// The `number`-th of `count` points that fill the unit disc evenly; a single one is its middle.
fn disc_point(number: u32, count: u32, turn: f32) -> (f32, f32) {
    if count == 1 {
        return (0.0, 0.0);
    }
    let radius = ((number as f32 + 0.5) / count as f32).sqrt();
    let (sin, cos) = (TAU * (number as f32 * 0.618_034 + turn)).sin_cos();
    (radius * cos, radius * sin)
}
