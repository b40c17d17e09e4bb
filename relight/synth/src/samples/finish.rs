//! The finish of an object: paint, relief and gloss.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::geometry::GBuffer;
use crate::library::Library;
use crate::lighting::{BlinnPhong, Material};
use crate::mesh::SurfaceSample;
use crate::paint::{AlbedoKind, Paint, Relief, possible};
use crate::random::Random;

/// Part of the objects that have relief.
const RELIEF: f32 = 0.35;
/// The part of the objects with materials that keep them.
const OWN: f32 = 0.5;
/// Exponents of highlights.
const BROADEST: f32 = 4.0;
const SHARPEST: f32 = 150.0;
/// The part that a non-metal reflects at its highlight.
const DIELECTRIC: f32 = 0.04;
/// Rougher than this, a surface's highlight cannot be separated from its diffuse light.
const ROUGHEST: f32 = 0.9;

/// Paint, relief and gloss.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Finish {
    /// Its albedo.
    pub paint: Paint,
    /// Its relief.
    pub relief: Option<Relief>,
    /// Its highlights.
    pub gloss: Option<BlinnPhong>,
}

impl Finish {
    /// A random finish for what a buffer shows; it is glossy with the probability `glossy`. Half of the objects that come
    /// with materials keep them, with their gloss; with `own` all do.
    pub(crate) fn draw(
        random: &mut Random,
        buffer: &GBuffer,
        library: &Library,
        glossy: f32,
        own: bool,
    ) -> Self {
        if let Some(surface) = buffer.own_surface()
            && (own || random.chance(OWN))
        {
            return Self::own(surface);
        }
        Self::painted(random, buffer, library, glossy)
    }

    /// The same for an object whose materials, if it has any, are painted over.
    fn painted(random: &mut Random, buffer: &GBuffer, library: &Library, glossy: f32) -> Self {
        let pictures = library.pictures.len();
        let paint = Paint::draw(random, &buffer.object_points, pictures);
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

    /// From the mesh's own file, one gloss for the whole surface.
    fn own(surface: &[SurfaceSample]) -> Self {
        let albedo: Vec3 = surface.iter().map(own_albedo).sum();
        Self {
            paint: Paint::own(possible(albedo / surface.len() as f32)),
            relief: None,
            gloss: BlinnPhong::from_surface(surface),
        }
    }

    /// The finish on what a buffer shows.
    pub(crate) fn apply(&self, buffer: &GBuffer, library: &Library) -> Material {
        let normals = match &self.relief {
            Some(relief) => relief.apply(buffer),
            None => buffer.normals.clone(),
        };
        let own = buffer.own_surface();
        let own = own.filter(|_| self.paint.kind == AlbedoKind::Own);
        let albedo = match own {
            Some(own) => own.iter().map(|at| possible(own_albedo(at))).collect(),
            None => self.paint.apply(
                &buffer.object_points,
                buffer.texture.as_deref(),
                &library.pictures,
            ),
        };
        Material {
            albedo,
            normals,
            gloss: self.gloss,
        }
    }
}

/// Metal has no diffuse light.
fn own_albedo(surface: &SurfaceSample) -> Vec3 {
    surface.colour * (1.0 - surface.metallic)
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

    /// The highlights of a surface whose file states its roughness; `None` for a dull one. The exponent is 2 / roughness^4 - 2
    /// (Karis 2013, "Specular BRDF Reference"), and as much brighter as it gathers light, (exponent + 8) / 8 (Hoffman 2013,
    /// "Background: Physics and Math of Shading").
    fn from_surface(surface: &[SurfaceSample]) -> Option<Self> {
        let mean = |of: fn(&SurfaceSample) -> Vec3| {
            surface.iter().map(of).sum::<Vec3>() / surface.len().max(1) as f32
        };
        let roughness = mean(|at| Vec3::splat(at.roughness)).x;
        if roughness > ROUGHEST {
            return None;
        }
        let reflected = mean(|at| Vec3::splat(DIELECTRIC).lerp(at.colour, at.metallic));
        let exponent = (2.0 / roughness.powi(4) - 2.0).clamp(BROADEST, SHARPEST);
        Some(Self {
            reflectance: reflected * ((exponent + 8.0) / 8.0),
            exponent,
        })
    }

    /// A random strength and exponent.
    pub(crate) fn draw_strength(random: &mut Random) -> (f32, f32) {
        let exponent = random.log_uniform(BROADEST..SHARPEST);
        // A sharper highlight is brighter, as it gathers the same light.
        let strength = random.uniform(0.03..0.6) * ((exponent + 8.0) / 16.0).min(4.0);
        (strength, exponent)
    }
}
