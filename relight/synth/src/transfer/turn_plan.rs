//! The material, light and camera of a turn of a cast view: all its parameters except the noise.

use glam::Vec3;
use relight_core::light::ShLight;

use super::environment_lights::EnvironmentLights;
use super::timing::TableTiming;
use super::turn_view::TurnView;
use crate::lighting::BlinnPhong;
use crate::random::Random;

/// Harmonics of the table's angle that are computed.
const HARMONICS: usize = 6;
/// Terms of a curve: its mean, then real and imaginary part of each harmonic.
pub const CURVE_TERMS: usize = 2 * HARMONICS + 1;

/// Red, green and blue of each term of a curve `c_0 + Re Σ c_m e^(i m a)`: `c_0`, `Re c_1`, `Im c_1` and so on.
pub type CurveTerms = [[f32; 3]; CURVE_TERMS];

/// Part of the objects of metal.
const METAL: f32 = 0.22;
/// Part of the others without gloss.
const MATT: f32 = 0.3;
/// Part of the glossy ones whose highlights are as strong as a half vector's power is drawn in `synth`: up to half of the
/// light, in broad lobes. The others are plastic and varnish.
const HALF_VECTOR: f32 = 0.5;
/// Part of these whose highlights have the object's colour.
const TINTED: f32 = 0.2;
/// Part of the objects of one colour.
const PLAIN: f32 = 0.35;
/// Part of the turns with errors of the angle and missing frames.
const MISTIMED: f32 = 0.4;
/// Part of the turns whose highlights clip.
const CLIPPED: f32 = 0.3;
/// Part of the turns with an error of the elevation, and its size, degrees.
const UNSURE: f32 = 0.5;
const ELEVATION_ERROR_DEG: f32 = 4.0;
const MAX_ELEVATION_ERROR_DEG: f32 = 8.0;
/// A turn of a view.
#[derive(Debug, Clone, PartialEq)]
pub struct TurnPlan {
    /// Which of the view's materials.
    pub finish: usize,
    /// The one colour of an object that has only one.
    pub plain: Option<[f32; 3]>,
    /// The factor of its albedo where it has more.
    pub brightness: f32,
    /// The light of each term of a curve, in harmonics of the table's frame, [`TurnView::ORDER`].
    pub light: Vec<CurveTerms>,
    /// How the surface sends light back.
    pub material: TurnMaterial,
    /// The part of the brightness, from dark to bright, beyond which highlights clip.
    pub clipped: Option<f32>,
    /// What each true term adds to each that is found, row by row.
    pub timing: Option<[[f32; CURVE_TERMS]; CURVE_TERMS]>,
    /// Deviation of the noise, as a part of the object's mean brightness and of each pixel's.
    pub noise: [f32; 2],
    /// The stated elevation, radians; the true one is near.
    pub elevation: f32,
    /// Whether it is seen in a mirror, left and right: the table turns the other way.
    pub is_mirrored: bool,
}

/// How a surface sends light back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnMaterial {
    /// Whether it has no diffuse part: its albedo is the colour of what it mirrors.
    pub is_metal: bool,
    /// The part of even light that it mirrors head-on: 0.04 for plastic, 0 without gloss, 1 for metal.
    pub reflectance: f32,
    /// Whether highlights become stronger as the surface is seen from aside, by Schlick's approximation of Fresnel's
    /// reflectance (plastic, varnish); else weaker, by the cosine (a power of the half vector's cosine, as
    /// [`BlinnPhong`](crate::BlinnPhong) has it).
    pub is_fresnel: bool,
    /// Whether highlights have the object's own colour, brought to its largest channel. Those of metal always have.
    pub is_tinted: bool,
    /// How far it blurs what it mirrors, radians (the deviation of a Gaussian on the sphere).
    pub blur: f32,
    /// How much of the light that it throws onto itself counts, 0..=1.
    pub bounce: f32,
}

impl TurnPlan {
    /// The turn of a seed, of a view from this elevation, in one of these rooms.
    pub fn draw(seed: u64, elevation: f32, rooms: &EnvironmentLights) -> Self {
        let mut random = Random::new(seed);
        let is_plain = random.chance(PLAIN);
        let tint = Vec3::from_array([(); 3].map(|()| (random.normal() * 0.3).exp()));
        let plain = (tint * random.log_uniform(0.05..0.9)).min(Vec3::splat(0.95));
        let light = rooms.draw(random.seed());
        let error = (random.normal() * ELEVATION_ERROR_DEG)
            .clamp(-MAX_ELEVATION_ERROR_DEG, MAX_ELEVATION_ERROR_DEG);
        let error = if random.chance(UNSURE) { error } else { 0.0 };
        let timing = random.chance(MISTIMED);
        Self {
            finish: random.index(TurnView::FINISHES),
            plain: is_plain.then(|| plain.to_array()),
            brightness: random.log_uniform(0.1..1.0),
            light: terms_of(&light),
            material: TurnMaterial::draw(&mut random),
            clipped: random.chance(CLIPPED).then(|| random.uniform(0.6..0.99)),
            timing: timing
                .then(|| TableTiming::draw(&mut random))
                .flatten()
                .map(|timing| timing.matrix),
            noise: [
                random.log_uniform(0.0003..0.006),
                random.log_uniform(0.0005..0.01),
            ],
            elevation: (elevation + error.to_radians()).max(0.0),
            is_mirrored: random.chance(0.5),
        }
    }
}

impl TurnMaterial {
    /// Metal, or a diffuse surface with or without gloss.
    fn draw(random: &mut Random) -> Self {
        let is_metal = random.chance(METAL);
        let material = Self {
            is_metal,
            reflectance: 1.0,
            is_fresnel: true,
            is_tinted: false,
            blur: random.log_uniform(0.05..0.6),
            bounce: random.uniform(0.0..1.0),
        };
        if is_metal {
            return material;
        }
        if random.chance(MATT) {
            return Self {
                reflectance: 0.0,
                ..material
            };
        }
        if random.chance(HALF_VECTOR) {
            let (strength, exponent) = BlinnPhong::draw_strength(random);
            return Self {
                is_tinted: random.chance(TINTED),
                ..material.with_half_vector(strength, exponent)
            };
        }
        Self {
            reflectance: random.log_uniform(0.02..0.15),
            ..material
        }
    }

    /// The gloss of a power of the half vector's cosine, which the transfer shows as a Gaussian around the mirrored
    /// direction: the lobe's solid angle is 8 π / (exponent + 1) times the cosine to the eye, and light moves by twice the
    /// half vector's angle.
    pub(super) fn with_half_vector(self, reflectance: f32, exponent: f32) -> Self {
        Self {
            reflectance: 8.0 * reflectance / (exponent + 1.0),
            blur: 2.0 / exponent.max(1.0).sqrt(),
            is_fresnel: false,
            ..self
        }
    }
}

/// The light that makes each term of a curve: with the pairs of order m as complex numbers, `L_m = L_lm + i L_l-m`, a pixel that
/// takes T of the light has `c_m = Σ_l T_lm conj(L_lm)`.
pub(super) fn terms_of(light: &ShLight) -> Vec<CurveTerms> {
    let light = light.with_order(TurnView::ORDER);
    let light = light.coefficients();
    let mut terms = vec![[[0.0; 3]; CURVE_TERMS]; light.len()];
    for l in 0..=TurnView::ORDER.get() {
        let middle = l * (l + 1);
        terms[middle][0] = light[middle].map(|value| value as f32);
        for m in 1..=l.min(HARMONICS) {
            let [of_cos, of_sin] =
                [light[middle + m], light[middle - m]].map(|of| of.map(|v| v as f32));
            terms[middle + m][2 * m - 1] = of_cos;
            terms[middle - m][2 * m - 1] = of_sin;
            terms[middle - m][2 * m] = of_cos;
            terms[middle + m][2 * m] = of_sin.map(|value| -value);
        }
    }
    terms
}
