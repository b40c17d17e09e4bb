//! What an object is made of: paint, relief and gloss together.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::geometry::GBuffer;
use super::library::Library;
use super::lighting::{BlinnPhong, Material};
use super::paint::{AlbedoKind, Paint, Relief};
use super::random::Random;

/// Part of the objects that have relief.
const RELIEF: f32 = 0.35;

/// Paint, relief and gloss.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finish {
    /// Its albedo.
    pub paint: Paint,
    /// Its relief.
    pub relief: Option<Relief>,
    /// Its highlights.
    pub gloss: Option<BlinnPhong>,
}

impl Finish {
    /// A random finish for what a buffer shows; it is glossy with the probability `glossy`, and
    /// painted as `albedo` says, where that says anything.
    pub(super) fn draw(
        random: &mut Random,
        buffer: &GBuffer,
        library: &Library,
        glossy: f32,
        albedo: Option<AlbedoKind>,
    ) -> Self {
        let pictures = library.pictures.len();
        let paint = Paint::draw(random, buffer.object_points(), pictures, albedo);
        let relief = random.chance(RELIEF).then(|| Relief::draw(random));
        let gloss = random
            .chance(glossy)
            .then(|| BlinnPhong::draw(random, &paint));
        Self {
            paint,
            relief,
            gloss,
        }
    }

    /// The finish on what a buffer shows.
    #[must_use]
    pub fn apply(&self, buffer: &GBuffer, library: &Library) -> Material {
        let normals = match &self.relief {
            Some(relief) => relief.apply(buffer),
            None => buffer.normals().to_vec(),
        };
        let pictures = &library.pictures;
        Material {
            albedo: self
                .paint
                .apply(buffer.object_points(), buffer.texture(), pictures),
            normals,
            gloss: self.gloss,
        }
    }
}

impl BlinnPhong {
    /// White highlights mostly, as of plastic and varnish; some in the object's own colour, as of metal.
    fn draw(random: &mut Random, paint: &Paint) -> Self {
        let (strength, exponent) = Self::draw_strength(random);
        let colour = if random.chance(0.2) {
            paint.ground / paint.ground.max_element().max(1e-3)
        } else {
            Vec3::ONE
        };
        Self {
            reflectance: colour * strength,
            exponent,
        }
    }

    /// A random strength and exponent.
    pub(super) fn draw_strength(random: &mut Random) -> (f32, f32) {
        let exponent = random.log_uniform(4.0..150.0);
        // A sharper highlight is brighter, as it gathers the same light.
        let strength = random.uniform(0.03..0.6) * ((exponent + 8.0) / 16.0).min(4.0);
        (strength, exponent)
    }
}
