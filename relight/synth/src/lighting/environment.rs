//! Light from a panorama.

use std::f32::consts::{PI, TAU};

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::shaded::{BlinnPhong, Material, Shaded};
use crate::geometry::{GBuffer, Occluder};
use crate::random::{mix, stream, unit_of};
use crate::vectors::{direction, vector};
use relight_core::light::{LightSampler, Order, Panorama, Rotation, ShLight};

/// Strata along each side of the square from which directions are drawn: 64 rays a pixel.
const STRATA: usize = 8;
/// Choices within a stratum, from pixel to pixel.
const CHOICES: usize = 64;
/// Rays a pixel in proportion to the panorama's light.
const LIGHT_RAYS: f32 = (STRATA * STRATA) as f32;
/// Rays a pixel in proportion to the cosine.
const COSINE_RAYS: u32 = 32;
/// Rays a pixel along the lobe of a highlight.
const LOBE_RAYS: u32 = 16;
/// Half vectors at right angles to the eye belong to no light.
const MIN_COSINE: f32 = 1e-4;

/// The panoramas that there are, each with its coefficients.
#[derive(Debug, Clone, Default)]
pub struct Panoramas {
    entries: Vec<Entry>,
}

#[derive(Debug, Clone)]
struct Entry {
    name: String,
    panorama: Panorama,
    /// All bands that a diffuse surface shows, scaled to a mean irradiance of 1.
    light: ShLight,
    /// What the panorama's radiance was scaled by.
    scale: f64,
}

/// A panorama around an object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Environment {
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
pub(crate) enum Method {
    /// By its nine coefficients, times the part of the sky that is seen: light as the paper estimates it. Makes no
    /// highlight.
    OrderTwo,
    /// By all bands that a diffuse surface shows of it, times the part of the sky that is seen. Makes no highlight.
    Smooth,
    /// By rays, each blocked or not; highlights with rays along the lobe too.
    MonteCarlo,
}

impl Panoramas {
    /// Panoramas by name. Those that are black are left out.
    pub fn new(named: Vec<(String, Panorama)>) -> Self {
        let entries = named.into_iter().filter_map(|(name, panorama)| {
            let light = panorama.project(Order::HIGHLIGHT);
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

    /// Keeps those whose name is wanted.
    pub(crate) fn retain(&mut self, wanted: impl Fn(&str) -> bool) {
        self.entries.retain(|entry| wanted(&entry.name));
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// The name of one of them.
    pub fn name(&self, number: usize) -> Option<&str> {
        self.entries.get(number).map(|entry| entry.name.as_str())
    }

    /// The names of all.
    pub fn names(&self) -> Vec<String> {
        self.entries
            .iter()
            .map(|entry| entry.name.clone())
            .collect()
    }

    /// One of them.
    pub fn get(&self, number: usize) -> Option<&Panorama> {
        self.entries.get(number).map(|entry| &entry.panorama)
    }
}

impl Environment {
    /// The light as the coefficients whose irradiance the method takes; `None` if it casts rays.
    pub(super) fn smooth(&self, panoramas: &Panoramas) -> Option<ShLight> {
        match self.method {
            Method::OrderTwo => Some(self.coefficients(Order::TWO, panoramas)),
            Method::Smooth => Some(self.coefficients(Order::HIGHLIGHT, panoramas)),
            Method::MonteCarlo => None,
        }
    }

    /// The light as coefficients of an order up to [`Order::HIGHLIGHT`], in the viewer's frame; dark where there is no
    /// such panorama.
    pub(crate) fn coefficients(&self, order: Order, panoramas: &Panoramas) -> ShLight {
        match panoramas.entries.get(self.panorama) {
            Some(entry) => entry
                .light
                .with_order(order)
                .rotated(&self.turn())
                .tinted(self.irradiance.to_array().map(f64::from)),
            None => ShLight::dark(order),
        }
    }

    /// The same light, turned further.
    pub(crate) fn turned(&self, turn: &Rotation) -> Self {
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
    /// `None` if this panorama does not exist.
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

    /// The light from a direction that was drawn otherwise.
    fn along(&self, towards: Vec3) -> SkyRay {
        let from = self.back.apply(direction(towards));
        let radiance = self.sampler.panorama().radiance(from);
        SkyRay {
            towards,
            radiance: Vec3::from_array(radiance) * self.colour,
            density: self.sampler.density(from) as f32,
        }
    }

    /// Adds the panorama's light. Without an occluder only the horizon blocks it.
    pub(super) fn light(
        &self,
        buffer: &GBuffer,
        material: &Material,
        occluder: Option<&Occluder>,
        seed: u64,
        shaded: &mut Shaded,
    ) {
        for k in 0..buffer.len() {
            let point = Point {
                normal: material.normals[k],
                towards_eye: buffer.towards_eye[k],
                gloss: material.gloss.as_ref(),
            };
            let arrives = |towards: Vec3| {
                point.normal.dot(towards) > 0.0
                    && occluder.is_none_or(|occluder| {
                        buffer.normals[k].dot(towards) > 0.0
                            && !occluder.blocks(buffer.ray_starts[k], towards, f32::INFINITY)
                    })
            };
            let own = stream(seed, u64::from(buffer.pixels[k]));
            let drawn = point.drawn(own).map(|towards| self.along(towards));
            let rays = self.rays_of(own).copied().chain(drawn);
            for ray in rays.filter(|ray| arrives(ray.towards)) {
                // Veach's balance heuristic: whichever way drew the ray, all ways count.
                let light = ray.radiance / (LIGHT_RAYS * ray.density + point.density(ray.towards));
                shaded.shading[k] += light * point.normal.dot(ray.towards);
                if let Some(gloss) = point.gloss {
                    let lobe = gloss.lobe(point.normal, ray.towards, point.towards_eye);
                    shaded.highlight[k] += light * lobe * gloss.reflectance;
                }
            }
        }
    }
}

/// A point of a surface, with the directions from which light reaches it.
struct Point<'a> {
    normal: Vec3,
    towards_eye: Vec3,
    gloss: Option<&'a BlinnPhong>,
}

impl Point<'_> {
    /// Directions along the cosine, and along the lobe of a highlight.
    fn drawn(&self, seed: u64) -> impl Iterator<Item = Vec3> {
        let (right, up) = self.normal.any_orthonormal_pair();
        let around = move |cosine: f32, turn: f32| {
            let radius = (1.0 - cosine * cosine).max(0.0).sqrt();
            let (sin, cos) = (TAU * turn).sin_cos();
            (right * cos + up * sin) * radius + self.normal * cosine
        };
        let place = move |number: u32, count: u32, salt: u64| {
            let [first, second] =
                [0, 1].map(|k| unit_of(mix(stream(seed, salt + 2 * u64::from(number) + k))));
            let turn = number as f32 * 0.618_034 + second;
            ((number as f32 + first) / count as f32, turn)
        };
        let lambertian = (0..COSINE_RAYS).map(move |number| {
            let (part, turn) = place(number, COSINE_RAYS, 1_000);
            around(part.sqrt(), turn)
        });
        let glossy = self.gloss.into_iter().flat_map(move |gloss| {
            (0..LOBE_RAYS).filter_map(move |number| {
                let (part, turn) = place(number, LOBE_RAYS, 2_000);
                // The half vector is drawn in proportion to its power of the cosine.
                let half = around(part.powf(1.0 / (gloss.exponent + 1.0)), turn);
                let along = half.dot(self.towards_eye);
                let mirrored = half * (2.0 * along) - self.towards_eye;
                (along > MIN_COSINE).then(|| mirrored.normalize_or(self.normal))
            })
        });
        lambertian.chain(glossy)
    }

    /// How many of the directions that are drawn lie around this one, per steradian.
    fn density(&self, towards: Vec3) -> f32 {
        let lambertian = COSINE_RAYS as f32 * self.normal.dot(towards).max(0.0) / PI;
        let Some(gloss) = self.gloss else {
            return lambertian;
        };
        let half = (towards + self.towards_eye).normalize_or_zero();
        let along = half.dot(self.towards_eye);
        if along <= MIN_COSINE {
            return lambertian;
        }
        let lobe = gloss.lobe(self.normal, towards, self.towards_eye);
        // A step of the half vector is a quarter of the light's, over the cosine to the eye.
        let of_half = (gloss.exponent + 1.0) / (2.0 * PI) * lobe;
        lambertian + LOBE_RAYS as f32 * of_half / (4.0 * along)
    }
}
