//! Random lightings.

use glam::{Mat3, Vec3};
use serde::{Deserialize, Serialize};

use super::{Emitter, Environment, Lighting, Method, Panoramas, SyntheticLamp};
use crate::geometry::GBuffer;
use crate::random::Random;
use crate::vectors::rotation_rows;

/// How far tables are from level, radians: the deviation about each of two axes.
const LEVEL: f32 = 0.04;

/// What kind of light is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LightKind {
    /// What trained best: one lamp mostly, else a few, or a panorama; ambient and bounced light in
    /// other tints than the lamp's.
    #[default]
    Mixed,
    /// One to three lamps, with ambient light.
    Lamps,
    /// A panorama's nine coefficients, and nothing else.
    Sh,
    /// A panorama by rays, and nothing else.
    MonteCarlo,
}

impl Lighting {
    /// A random lighting for an object seen in `buffer`.
    pub(crate) fn draw(
        random: &mut Random,
        kind: LightKind,
        buffer: &GBuffer,
        panoramas: &Panoramas,
    ) -> Self {
        let lighting = Self {
            has_shadows: true,
            ..Self::default()
        };
        let around = |random: &mut Random, method, irradiance| {
            Environment::draw(random, panoramas, method, irradiance)
        };
        match kind {
            LightKind::Sh => Self {
                environment: around(random, Method::OrderTwo, Vec3::ONE),
                ..lighting
            },
            LightKind::MonteCarlo => Self {
                environment: around(random, Method::MonteCarlo, Vec3::ONE),
                ..lighting
            },
            LightKind::Lamps => lighting.with_lamps(random, buffer, panoramas),
            LightKind::Mixed if random.chance(0.8) => {
                lighting.with_lamps(random, buffer, panoramas)
            }
            LightKind::Mixed => {
                let tint = tint(random, 0.1);
                let mut sky = Self {
                    environment: around(random, Method::Smooth, tint),
                    ..lighting
                };
                if random.chance(0.4) {
                    let strength = random.uniform(0.3..2.0);
                    sky.lamps = vec![SyntheticLamp::draw(random, buffer, strength)];
                }
                sky.with_bounce(random)
            }
        }
    }

    fn with_lamps(mut self, random: &mut Random, buffer: &GBuffer, panoramas: &Panoramas) -> Self {
        let (count, most_ambient) =
            random.weighted([((1, 0.25), 0.75), ((2, 0.3), 0.15), ((3, 0.3), 0.1)]);
        self.lamps = (0..count)
            .map(|_| {
                let strength = if count == 1 {
                    1.0
                } else {
                    random.uniform(0.2..1.0)
                };
                SyntheticLamp::draw(random, buffer, strength)
            })
            .collect();
        let nearly_none = random.chance(0.4);
        let ambient = random.uniform(0.0..if nearly_none { 0.04 } else { most_ambient });
        // Another tint than the lamp's: shaded parts shift in colour.
        let colour = tint(random, 0.15) * ambient;
        if random.chance(0.4) {
            self.environment = Environment::draw(random, panoramas, Method::Smooth, colour);
        }
        if self.environment.is_none() {
            self.ambient = colour;
        }
        self.with_bounce(random)
    }

    fn with_bounce(mut self, random: &mut Random) -> Self {
        self.bounce = tint(random, 0.15) * random.uniform(0.0..1.0);
        self
    }
}

impl SyntheticLamp {
    /// A lamp of this irradiance that lights a good part of the visible surface.
    pub(crate) fn draw(random: &mut Random, buffer: &GBuffer, strength: f32) -> Self {
        let towards = lighting_direction(random, buffer);
        let (emitter, rays) = if random.chance(0.3) {
            let centre = towards * random.uniform(2.5..7.0);
            let radius = random.uniform(0.2..1.2);
            (Emitter::Disc { centre, radius }, 12)
        } else {
            let half_angle = random.pick([0.0, 0.03, 0.1]);
            let rays = if half_angle == 0.0 { 1 } else { 6 };
            (
                Emitter::Distant {
                    towards,
                    half_angle,
                },
                rays,
            )
        };
        Self {
            emitter,
            irradiance: tint(random, 0.12) * strength,
            rays,
        }
    }
}

impl Environment {
    /// At a random rotation: about the vertical mostly, with a little tilt, else any. `None` without
    /// panoramas.
    fn draw(
        random: &mut Random,
        panoramas: &Panoramas,
        method: Method,
        irradiance: Vec3,
    ) -> Option<Self> {
        if panoramas.is_empty() {
            return None;
        }
        let turn = if random.chance(0.7) {
            let around = Mat3::from_rotation_y(random.uniform(0.0..std::f32::consts::TAU));
            Mat3::from_rotation_x(random.uniform(-0.1..0.8)) * around
        } else {
            random.rotation()
        };
        Some(Self {
            panorama: random.index(panoramas.len()),
            rotation: rotation_rows(turn),
            irradiance,
            method,
        })
    }

    /// The same light around a table that stands level in it, but for a few degrees: the panorama's zenith is along the
    /// table's axis. `elevation` is that of the camera over the table, radians.
    pub(crate) fn level(self, random: &mut Random, elevation: f32) -> Self {
        let around = Mat3::from_rotation_y(random.uniform(0.0..std::f32::consts::TAU));
        let lean = Mat3::from_rotation_x(elevation + random.normal() * LEVEL)
            * Mat3::from_rotation_z(random.normal() * LEVEL);
        Self {
            rotation: rotation_rows(lean * around),
            ..self
        }
    }
}

/// A direction from which a good part of the visible surface is lit.
fn lighting_direction(random: &mut Random, buffer: &GBuffer) -> Vec3 {
    let mut best = (Vec3::Z, f32::NEG_INFINITY);
    for _ in 0..6 {
        let mut towards = random.direction();
        towards.z = towards.z.abs() * random.pick([0.6, 1.2, 2.5]) + 0.05;
        if random.chance(0.6) {
            towards.y = towards.y.abs();
        }
        let towards = towards.normalize();
        let sampled = buffer.normals.iter().step_by(37);
        let (sum, count) = sampled.fold((0.0, 0.0), |(sum, count), normal| {
            (sum + normal.dot(towards).max(0.0), count + 1.0)
        });
        let mean = sum / f32::max(count, 1.0);
        if mean > 0.25 {
            return towards;
        }
        if mean > best.1 {
            best = (towards, mean);
        }
    }
    best.0
}

/// A colour near white, of mean 1.
pub(crate) fn tint(random: &mut Random, most: f32) -> Vec3 {
    let strength = random.pick([0.25, 0.6, 1.0]) * most;
    let colour = Vec3::from_array([(); 3].map(|()| (random.normal() * strength).exp()));
    colour * 3.0 / colour.element_sum()
}
