//! The Fourier coefficients of a view in a light: what a pixel shows over the table's angle.

use glam::Vec3;
use rayon::prelude::*;
use relight_core::light::ShLight;

use super::cast::{RadianceTransfer, TransferFinish, harmonics_at, table_frame};
use super::{BOUNCE_COEFFICIENTS, COEFFICIENTS, TRANSFER_ORDER, band, cosine_band};

/// Harmonics of the table's angle that are computed.
const HARMONICS: usize = 6;
/// A colour of less than this is black. Numerical.
const MIN_ALBEDO: f32 = 1e-3;
/// Terms of a curve: its mean, then real and imaginary part of each harmonic.
pub(super) const CURVE_COEFFICIENTS: usize = 2 * HARMONICS + 1;

/// Red, green and blue of each term of a pixel's curve `c_0 + Re Σ c_m e^(i m a)`: `c_0`, `Re c_1`, `Im c_1` and so on.
pub(crate) type CurveCoefficients = [[f32; 3]; CURVE_COEFFICIENTS];

/// How a surface sends light back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TransferMaterial {
    /// Whether it has no diffuse part: its albedo is the colour of what it mirrors.
    pub is_metal: bool,
    /// The part of even light that it mirrors head-on: 0.04 for plastic, 0 without gloss, 1 for metal.
    pub reflectance: f32,
    /// How that changes as the surface is seen from aside.
    pub lobe: TransferLobe,
    /// Whether highlights have the object's own colour, brought to its largest channel. Those of metal always have.
    pub is_tinted: bool,
    /// How far it blurs what it mirrors, radians (the deviation of a Gaussian on the sphere).
    pub blur: f32,
    /// How much of the light that it throws onto itself counts, 0..=1.
    pub bounce: f32,
}

/// How strong highlights are as a surface is seen from aside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TransferLobe {
    /// Stronger, by Schlick's approximation of Fresnel's reflectance: plastic, varnish.
    Fresnel,
    /// Weaker, by the cosine: a power of the half vector's cosine without a reflectance of its own, as
    /// [`BlinnPhong`](crate::BlinnPhong) has it.
    HalfVector,
}

impl TransferLobe {
    fn at(self, head_on: f32, facing: f32) -> f32 {
        match self {
            Self::Fresnel => schlick(head_on, facing),
            Self::HalfVector => head_on * facing,
        }
    }
}

impl TransferMaterial {
    /// The gloss of a power of the half vector's cosine, which the transfer shows as a Gaussian around the mirrored
    /// direction: the lobe's solid angle is 8 π / (exponent + 1) times the cosine to the eye, and light moves by twice the
    /// half vector's angle.
    pub(super) fn with_half_vector(self, reflectance: f32, exponent: f32) -> Self {
        Self {
            reflectance: 8.0 * reflectance / (exponent + 1.0),
            blur: 2.0 / exponent.max(1.0).sqrt(),
            lobe: TransferLobe::HalfVector,
            ..self
        }
    }
}

/// The parts of a pixel's transfer, each in harmonics of the table's frame.
struct PixelTransfer {
    /// Per unit albedo.
    diffuse: [f32; COEFFICIENTS],
    gloss: Option<[f32; COEFFICIENTS]>,
}

impl RadianceTransfer {
    /// What each pixel shows of a light, over a whole turn. `light` is in the table's frame at the angle 0; bands beyond
    /// 8 do not count.
    ///
    /// # Panics
    /// Where the finish has not as many pixels.
    pub(super) fn curves(
        &self,
        finish: &TransferFinish,
        material: &TransferMaterial,
        light: &ShLight,
    ) -> Vec<CurveCoefficients> {
        let light = light.with_order(TRANSFER_ORDER);
        let light: Vec<[f32; 3]> = light
            .coefficients()
            .iter()
            .map(|c| c.map(|c| c as f32))
            .collect();
        let mean_albedo = finish.albedo.iter().sum::<Vec3>() / finish.albedo.len().max(1) as f32;
        let highlight = if material.is_tinted {
            mean_albedo / mean_albedo.max_element().max(MIN_ALBEDO)
        } else {
            Vec3::ONE
        };
        let mean_albedo = mean_albedo * material.bounce;
        (0..self.pixels.len())
            .into_par_iter()
            .map(|k| {
                let pixel = self.of_pixel(k, finish.normals[k], material);
                let mut curve = [[0.0; 3]; CURVE_COEFFICIENTS];
                add(
                    &mut curve,
                    &pixel.diffuse,
                    &light,
                    finish.albedo[k] / std::f32::consts::PI,
                );
                if !material.is_metal {
                    let back = finish.albedo[k] * mean_albedo / std::f32::consts::PI;
                    add(
                        &mut curve,
                        &self.bounced[k],
                        &light[..BOUNCE_COEFFICIENTS],
                        back,
                    );
                }
                if let Some(gloss) = pixel.gloss {
                    let colour = if material.is_metal {
                        finish.albedo[k]
                    } else {
                        highlight
                    };
                    add(&mut curve, &gloss, &light, colour);
                }
                curve
            })
            .collect()
    }

    fn of_pixel(&self, k: usize, normal: Vec3, material: &TransferMaterial) -> PixelTransfer {
        let to_table = table_frame(self.elevation);
        let mut diffuse = [0.0; COEFFICIENTS];
        if !material.is_metal {
            diffuse = harmonics_at(TRANSFER_ORDER, to_table * normal);
            for (at, (value, blocked)) in diffuse.iter_mut().zip(&self.blocked[k]).enumerate() {
                *value = *value * cosine_band(band(at)) - blocked;
            }
        }
        let is_seen = self.mirrors[k] && material.reflectance > 0.0;
        let gloss = is_seen.then(|| {
            let eye = self.towards_eye[k];
            let facing = normal.dot(eye).max(0.0);
            let mirrored = normal * (2.0 * facing) - eye;
            let part = material.lobe.at(material.reflectance, facing);
            let mut gloss: [f32; COEFFICIENTS] =
                harmonics_at(TRANSFER_ORDER, to_table * mirrored.normalize_or(normal));
            for (at, value) in gloss.iter_mut().enumerate() {
                *value *= part * blurred(band(at), material.blur);
            }
            gloss
        });
        PixelTransfer { diffuse, gloss }
    }
}

/// Schlick's approximation of Fresnel's reflectance.
fn schlick(head_on: f32, facing: f32) -> f32 {
    head_on + (1.0 - head_on) * (1.0 - facing).powi(5)
}

/// What a Gaussian blur on the sphere leaves of a band.
fn blurred(l: usize, blur: f32) -> f32 {
    (-0.5 * (l * (l + 1)) as f32 * blur * blur).exp()
}

/// Adds a transfer in a light, times a colour.
fn add(curve: &mut CurveCoefficients, transfer: &[f32], light: &[[f32; 3]], colour: Vec3) {
    let top = band(transfer.len() - 1);
    for l in 0..=top {
        let middle = l * (l + 1);
        for m in 0..=l.min(HARMONICS) {
            let (of_cos, of_sin) = (transfer[middle + m], transfer[middle - m]);
            let (light_cos, light_sin) = (light[middle + m], light[middle - m]);
            for c in 0..3 {
                if m == 0 {
                    curve[0][c] += colour[c] * of_cos * light_cos[c];
                    continue;
                }
                let real = of_cos * light_cos[c] + of_sin * light_sin[c];
                let imaginary = of_sin * light_cos[c] - of_cos * light_sin[c];
                curve[2 * m - 1][c] += colour[c] * real;
                curve[2 * m][c] += colour[c] * imaginary;
            }
        }
    }
}
