//! Shading and highlight of a surface in a light.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::lamp::{LampShadows, SyntheticLamp, turn};
use crate::geometry::GBuffer;
use relight_core::image::{Extent, Planes};
use relight_core::light::{Normals, ShLight};
use relight_core::render::{DiffuseForm, DiffuseLayer};

/// The material at the covered pixels of a buffer.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Linear red, green and blue, 0..=1.
    pub albedo: Vec<Vec3>,
    /// Unit normals, with relief.
    pub normals: Vec<Vec3>,
    /// Its highlights; `None` if it is Lambertian.
    pub gloss: Option<BlinnPhong>,
}

/// The Blinn-Phong highlight: `reflectance x max(0, n . b)^exponent`, where b lies half way
/// between the light and the eye.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BlinnPhong {
    /// The paper's `s_p`.
    pub reflectance: Vec3,
    /// The paper's alpha: 1 and above.
    pub exponent: f32,
}

impl BlinnPhong {
    /// The lobe, without its reflectance.
    pub(super) fn lobe(&self, normal: Vec3, towards: Vec3, towards_eye: Vec3) -> f32 {
        let half = (towards + towards_eye).normalize_or_zero();
        normal.dot(half).max(0.0).powf(self.exponent)
    }
}

/// Shading and highlight at the covered pixels of a buffer. A picture is
/// `albedo x shading + highlight`.
#[derive(Debug, Clone, PartialEq)]
pub struct Shaded {
    /// Irradiance, linear red, green and blue.
    pub shading: Vec<Vec3>,
    /// Linear red, green and blue.
    pub highlight: Vec<Vec3>,
}

impl Shaded {
    /// No light on `pixels` pixels.
    pub(crate) fn dark(pixels: usize) -> Self {
        Self {
            shading: vec![Vec3::ZERO; pixels],
            highlight: vec![Vec3::ZERO; pixels],
        }
    }

    /// Adds a lamp. Without shadows, light goes through the object, and only what faces away from the
    /// lamp is dark. `seed` is that of the shadows.
    pub(crate) fn add_lamp(
        &mut self,
        buffer: &GBuffer,
        material: &Material,
        lamp: &SyntheticLamp,
        shadows: Option<&LampShadows>,
        seed: u64,
    ) {
        let share = lamp.irradiance / lamp.rays.max(1) as f32;
        for k in 0..buffer.len() {
            let (normal, eye) = (material.normals[k], buffer.towards_eye[k]);
            let rays = lamp.rays_from(buffer.points[k], turn(seed, buffer.pixels[k]));
            let (mut diffuse, mut lobes) = (0.0, 0.0);
            for (number, ray) in rays.enumerate() {
                let cosine = normal.dot(ray.towards);
                let arrives = shadows.is_none_or(|shadows| shadows.arrives(k, number));
                if cosine <= 0.0 || !arrives {
                    continue;
                }
                diffuse += cosine * ray.strength;
                if let Some(gloss) = &material.gloss {
                    lobes += gloss.lobe(normal, ray.towards, eye) * ray.strength;
                }
            }
            self.shading[k] += share * diffuse;
            if let Some(gloss) = &material.gloss {
                self.highlight[k] += share * lobes * gloss.reflectance;
            }
        }
    }

    /// Adds light by its coefficients: its irradiance, times the part of the sky that each pixel sees (`open`).
    /// It makes no highlight.
    pub(crate) fn add_smooth(
        &mut self,
        material: &Material,
        light: &ShLight,
        open: Option<&[f32]>,
    ) {
        let shading = irradiance(&material.normals, light);
        for (k, (sum, shading)) in self.shading.iter_mut().zip(shading).enumerate() {
            *sum += shading * open.map_or(1.0, |open| open[k]);
        }
    }

    /// Adds even light from all around.
    pub(crate) fn add_ambient(&mut self, irradiance: Vec3, open: Option<&[f32]>) {
        for (k, sum) in self.shading.iter_mut().enumerate() {
            *sum += irradiance * open.map_or(1.0, |open| open[k]);
        }
    }

    /// Adds light that the object throws into its own hollows, an approximation: of the part that sees
    /// the object instead of the sky, `strength` times the light that the surface around sends back, which is its
    /// albedo times its shading. So black objects throw none, and red ones red light.
    pub(crate) fn add_bounce(
        &mut self,
        buffer: &GBuffer,
        albedo: &[Vec3],
        strength: Vec3,
        open: &[f32],
    ) {
        let sent: Vec<Vec3> = albedo
            .iter()
            .zip(&self.shading)
            .map(|(a, s)| *a * *s)
            .collect();
        let around = buffer.blurred(&sent, buffer.size / 16);
        for ((sum, around), open) in self.shading.iter_mut().zip(around).zip(open) {
            *sum += strength * around * (1.0 - open);
        }
    }

    /// All light times a colour.
    pub(crate) fn scale(&mut self, colour: Vec3) {
        for value in self.shading.iter_mut().chain(&mut self.highlight) {
            *value *= colour;
        }
    }

    /// What the surface sends to the camera.
    pub fn image(&self, albedo: &[Vec3]) -> Vec<Vec3> {
        let diffuse = albedo.iter().zip(&self.shading).map(|(a, s)| *a * *s);
        diffuse.zip(&self.highlight).map(|(d, h)| d + *h).collect()
    }
}

/// The diffuse layer on a list of normals.
fn irradiance(normals: &[Vec3], light: &ShLight) -> Vec<Vec3> {
    let component = |axis: usize| normals.iter().map(|n| n[axis]).collect();
    let extent = Extent::new(normals.len(), 1);
    let planes = Planes::from_planes(extent, [0, 1, 2].map(component));
    let Ok(planes) = planes else {
        return vec![Vec3::ZERO; normals.len()];
    };
    let layer = DiffuseLayer::new(light, DiffuseForm::Irradiance);
    let shading = layer.shading(&Normals::new(planes)).into_planes();
    let [r, g, b] = shading.planes();
    let channels = r.iter().zip(g).zip(b);
    channels.map(|((&r, &g), &b)| Vec3::new(r, g, b)).collect()
}
