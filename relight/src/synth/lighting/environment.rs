//! Light from a panorama.

use std::f32::consts::{PI, TAU};

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::shaded::{BlinnPhong, Material, Shaded};
use super::{direction, vector};
use crate::light::{LightSampler, Order, Panorama, Rotation, ShLight};
use crate::synth::geometry::{GBuffer, Occluder};
use crate::synth::random::{mix, stream, unit_of};

/// Strata along each side of the square from which directions are drawn: 64 rays a pixel.
const STRATA: usize = 8;
/// Choices within a stratum, from pixel to pixel.
const CHOICES: usize = 64;
/// Rays a pixel along the lobe of a highlight.
const LOBE_RAYS: u64 = 16;

/// The panoramas that there are, each with its coefficients.
#[derive(Debug, Clone, Default)]
pub struct Panoramas {
    entries: Vec<Entry>,
}

#[derive(Debug, Clone)]
struct Entry {
    name: String,
    panorama: Panorama,
    /// Of order 2, scaled to a mean irradiance of 1.
    light: ShLight,
    /// What the panorama's radiance was scaled by.
    scale: f64,
}

/// A panorama around an object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Environment {
    /// Its number among the [`Panoramas`].
    pub panorama: usize,
    /// From the panorama's frame into the viewer's, a rotation matrix row by row.
    pub rotation: [[f64; 3]; 3],
    /// The mean irradiance over all normals is this, for a grey panorama.
    pub irradiance: Vec3,
    /// How it is evaluated.
    pub method: Method,
}

/// How a panorama's light is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// By its nine coefficients, times the part of the sky that is seen. Makes no highlight.
    Smooth,
    /// By rays, each blocked or not; highlights with rays along the lobe too.
    MonteCarlo,
}

impl Panoramas {
    /// Panoramas by name. Those that are black are left out.
    #[must_use]
    pub fn new(named: Vec<(String, Panorama)>) -> Self {
        let entries = named.into_iter().filter_map(|(name, panorama)| {
            let light = panorama.project(Order::TWO);
            let mean = light.coefficients()[0].iter().sum::<f64>() / 3.0;
            // The mean irradiance is pi times the mean radiance, which is the first coefficient times
            // the constant harmonic.
            let scale = 1.0 / (mean * std::f64::consts::PI / (4.0 * std::f64::consts::PI).sqrt());
            (scale.is_finite() && scale > 0.0).then(|| Entry {
                name,
                light: light.tinted([scale; 3]),
                panorama,
                scale,
            })
        });
        Self {
            entries: entries.collect(),
        }
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// The name of one of them.
    #[must_use]
    pub fn name(&self, number: usize) -> Option<&str> {
        self.entries.get(number).map(|entry| entry.name.as_str())
    }

    /// One of them.
    #[must_use]
    pub fn get(&self, number: usize) -> Option<&Panorama> {
        self.entries.get(number).map(|entry| &entry.panorama)
    }
}

impl Environment {
    /// The light as coefficients of order 2, in the viewer's frame; dark where there is no such
    /// panorama.
    #[must_use]
    pub fn coefficients(&self, panoramas: &Panoramas) -> ShLight {
        match panoramas.entries.get(self.panorama) {
            Some(entry) => entry
                .light
                .rotated(&self.turn())
                .tinted(self.irradiance.to_array().map(f64::from)),
            None => ShLight::dark(Order::TWO),
        }
    }

    /// The same light, turned further.
    #[must_use]
    pub fn turned(&self, turn: &Rotation) -> Self {
        Self {
            rotation: *turn.after(&self.turn()).matrix(),
            ..self.clone()
        }
    }

    fn turn(&self) -> Rotation {
        Rotation::from_matrix(self.rotation).unwrap_or(Rotation::IDENTITY)
    }
}

/// A panorama in its place around an object, ready for rays.
pub(super) struct Sky<'a> {
    sampler: LightSampler<'a>,
    /// From the panorama's frame into the viewer's, and back.
    turn: Rotation,
    back: Rotation,
    /// What the panorama's radiance is multiplied with.
    colour: Vec3,
    /// For each stratum its choices.
    rays: Vec<SkyRay>,
}

#[derive(Clone, Copy)]
struct SkyRay {
    /// Unit length, in the viewer's frame.
    towards: Vec3,
    radiance: Vec3,
    /// By which it was drawn, per steradian.
    density: f32,
}

impl<'a> Sky<'a> {
    /// None where there is no such panorama.
    pub(super) fn new(
        environment: &Environment,
        panoramas: &'a Panoramas,
        seed: u64,
    ) -> Option<Self> {
        let entry = panoramas.entries.get(environment.panorama)?;
        let turn = environment.turn();
        let mut sky = Self {
            sampler: LightSampler::new(&entry.panorama),
            turn,
            back: turn.inverse(),
            colour: environment.irradiance * entry.scale as f32,
            rays: Vec::with_capacity(STRATA * STRATA * CHOICES),
        };
        for stratum in 0..STRATA * STRATA {
            for choice in 0..CHOICES {
                let number = (stratum * CHOICES + choice) as u64;
                sky.rays.push(sky.draw(
                    stratum,
                    [0, 1].map(|k| f64::from(unit_of(mix(stream(seed, 2 * number + k))))),
                ));
            }
        }
        Some(sky)
    }

    fn draw(&self, stratum: usize, within: [f64; 2]) -> SkyRay {
        let corner = [stratum % STRATA, stratum / STRATA];
        let place = [0, 1].map(|k| (corner[k] as f64 + within[k]) / STRATA as f64);
        let drawn = self.sampler.draw(place);
        SkyRay {
            towards: vector(self.turn.apply(drawn.direction)),
            radiance: Vec3::from_array(drawn.radiance.map(|r| r as f32)) * self.colour,
            density: drawn.density as f32,
        }
    }

    /// The rays of a pixel, one a stratum.
    fn rays_of(&self, seed: u64) -> impl Iterator<Item = &SkyRay> {
        let choices = self.rays.chunks_exact(CHOICES);
        choices.enumerate().map(move |(stratum, choices)| {
            &choices[(mix(stream(seed, stratum as u64)) >> 32) as usize % CHOICES]
        })
    }

    fn along(&self, towards: Vec3) -> SkyRay {
        let from = self.back.apply(direction(towards));
        let radiance = self.sampler.panorama().radiance(from).map(|r| r as f32);
        SkyRay {
            towards,
            radiance: Vec3::from_array(radiance) * self.colour,
            density: self.sampler.density(from) as f32,
        }
    }

    /// Adds the panorama's light. Without an occluder nothing is in the way but the horizon.
    pub(super) fn light(
        &self,
        buffer: &GBuffer,
        material: &Material,
        occluder: Option<&Occluder>,
        seed: u64,
        shaded: &mut Shaded,
    ) {
        let count = (STRATA * STRATA) as f32;
        for k in 0..buffer.len() {
            let own = stream(seed, u64::from(buffer.pixels()[k]));
            let (normal, eye) = (material.normals[k], buffer.towards_eye()[k]);
            let arrives = |towards: Vec3| {
                normal.dot(towards) > 0.0
                    && occluder.is_none_or(|occluder| {
                        buffer.normals()[k].dot(towards) > 0.0
                            && !occluder.blocks(buffer.ray_starts()[k], towards, f32::INFINITY)
                    })
            };
            let (mut diffuse, mut shine) = (Vec3::ZERO, Vec3::ZERO);
            for ray in self.rays_of(own).filter(|ray| arrives(ray.towards)) {
                diffuse += ray.radiance * (normal.dot(ray.towards) / ray.density);
                if let Some(gloss) = &material.gloss {
                    let lobe = gloss.lobe(normal, ray.towards, eye);
                    let other = lobe_density(gloss, normal, ray.towards, eye);
                    shine += ray.radiance * lobe / (count * ray.density + LOBE_RAYS as f32 * other);
                }
            }
            shaded.shading[k] += diffuse / count;
            let Some(gloss) = &material.gloss else {
                continue;
            };
            for number in 0..LOBE_RAYS {
                let Some(towards) =
                    lobe_direction(gloss, normal, eye, stream(own, 1000 + number), number)
                else {
                    continue;
                };
                if arrives(towards) {
                    let ray = self.along(towards);
                    let lobe = gloss.lobe(normal, towards, eye);
                    let own_density = lobe_density(gloss, normal, towards, eye);
                    // Veach's balance heuristic between the two ways to draw a direction.
                    let density = count * ray.density + LOBE_RAYS as f32 * own_density;
                    shine += ray.radiance * lobe / density;
                }
            }
            shaded.highlight[k] += shine * gloss.reflectance;
        }
    }
}

/// A direction along the lobe: the half vector is drawn in proportion to its power of the cosine.
fn lobe_direction(
    gloss: &BlinnPhong,
    normal: Vec3,
    towards_eye: Vec3,
    seed: u64,
    number: u64,
) -> Option<Vec3> {
    let [first, second] = [0, 1].map(|k| unit_of(mix(stream(seed, k))));
    let height = (number as f32 + first) / LOBE_RAYS as f32;
    let cosine = height.powf(1.0 / (gloss.exponent + 1.0));
    let radius = (1.0 - cosine * cosine).max(0.0).sqrt();
    let (right, up) = normal.any_orthonormal_pair();
    let (sin, cos) = (TAU * (number as f32 * 0.618_034 + second)).sin_cos();
    let half = (right * cos + up * sin) * radius + normal * cosine;
    let along = half.dot(towards_eye);
    (along > 1e-4).then(|| (half * (2.0 * along) - towards_eye).normalize_or(normal))
}

/// The density with which [`lobe_direction`] draws a direction, per steradian.
fn lobe_density(gloss: &BlinnPhong, normal: Vec3, towards: Vec3, towards_eye: Vec3) -> f32 {
    let half = (towards + towards_eye).normalize_or_zero();
    let along = half.dot(towards_eye);
    if along <= 1e-4 {
        return 0.0;
    }
    let of_half =
        (gloss.exponent + 1.0) / (2.0 * PI) * normal.dot(half).max(0.0).powf(gloss.exponent);
    of_half / (4.0 * along)
}
