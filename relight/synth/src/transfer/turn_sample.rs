//! A view in a random material, environment light and camera, for training the network of turns.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::cast::{RadianceTransfer, TransferFinish};
use super::curves::{CURVE_COEFFICIENTS, CurveCoefficients, TransferLobe, TransferMaterial};
use super::environment_lights::EnvironmentLights;
use super::timing::TableTiming;
use crate::lighting::BlinnPhong;
use crate::random::Random;

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
/// Values of a curve at which clipping is looked at.
const ANGLES: usize = 36;

/// A turn as its curves, and the truth.
#[derive(Debug, Clone, PartialEq)]
pub struct TurnSample {
    /// Width and height, pixels.
    pub size: u32,
    /// The covered pixels, ascending: row times size plus column.
    pub pixels: Vec<u32>,
    /// Curves over the table's angle, with noise, clipping and errors of the angle.
    pub curves: Vec<CurveCoefficients>,
    /// The stated elevation, radians; the true one is near.
    pub elevation: f32,
    /// Unit normals in the viewer's frame.
    pub normals: Vec<Vec3>,
    /// Albedo; of metal its reflectance.
    pub albedo: Vec<Vec3>,
}

impl TurnSample {
    /// How turns are drawn: another number draws another turn of a seed.
    pub const RECIPE: u32 = 2;

    /// The turn of a seed: the view in a random material and environment light.
    pub(super) fn draw(view: &RadianceTransfer, rooms: &EnvironmentLights, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let finish = finish(view, &mut random);
        let material = TransferMaterial::draw(&mut random);
        let light = rooms.draw(random.seed());
        let curves = view.curves(&finish, &material, &light);
        let mut drawn = Self {
            size: view.size,
            pixels: view.pixels.clone(),
            curves,
            elevation: view.elevation,
            normals: finish.normals,
            albedo: finish.albedo,
        };
        if random.chance(CLIPPED) {
            drawn.clip(&mut random);
        }
        if random.chance(MISTIMED) {
            drawn.mistime(&mut random);
        }
        drawn.add_noise(&mut random);
        if random.chance(UNSURE) {
            let error = (random.normal() * ELEVATION_ERROR_DEG)
                .clamp(-MAX_ELEVATION_ERROR_DEG, MAX_ELEVATION_ERROR_DEG);
            drawn.elevation = (view.elevation + error.to_radians()).max(0.0);
        }
        if random.chance(0.5) {
            drawn.mirror();
        }
        drawn
    }

    /// The mean brightness of a pixel's curve.
    fn level(curve: &CurveCoefficients) -> f32 {
        curve[0].iter().sum::<f32>() / 3.0
    }

    /// The mean brightness of the object.
    fn mean_level(&self) -> f32 {
        let sum: f32 = self.curves.iter().map(Self::level).sum();
        sum / self.curves.len().max(1) as f32
    }

    /// Noise of the camera, of its compression, and of light that flickers.
    fn add_noise(&mut self, random: &mut Random) {
        let level = self.mean_level() * random.log_uniform(0.0003..0.006);
        let own = random.log_uniform(0.0005..0.01);
        for curve in &mut self.curves {
            let deviation = level + own * Self::level(curve).max(0.0);
            for value in curve[1..].as_flattened_mut() {
                *value += deviation * random.normal();
            }
        }
    }

    /// Cuts off what is brighter than a few pixels, as a camera does.
    fn clip(&mut self, random: &mut Random) {
        let mut brightest: Vec<f32> = self.curves.iter().map(brightest_of).collect();
        brightest.sort_by(f32::total_cmp);
        let part = random.uniform(0.6..0.99);
        let at = (part * brightest.len() as f32) as usize;
        let Some(&white) = brightest.get(at) else {
            return;
        };
        for curve in &mut self.curves {
            for c in 0..3 {
                clip_channel(curve, c, white);
            }
        }
    }

    /// The curves with errors of the table's angle.
    fn mistime(&mut self, random: &mut Random) {
        let Some(timing) = TableTiming::draw(random) else {
            return;
        };
        for curve in &mut self.curves {
            *curve = timing.seen(curve);
        }
    }

    /// The left-right mirror image, in which the table turns the other way.
    fn mirror(&mut self) {
        let mut order: Vec<usize> = (0..self.pixels.len()).collect();
        let size = self.size;
        let mirrored = |pixel: u32| pixel / size * size + (size - 1 - pixel % size);
        order.sort_by_key(|&k| mirrored(self.pixels[k]));
        self.normals = order
            .iter()
            .map(|&k| self.normals[k] * Vec3::new(-1.0, 1.0, 1.0))
            .collect();
        self.albedo = order.iter().map(|&k| self.albedo[k]).collect();
        self.curves = order
            .iter()
            .map(|&k| {
                let mut curve = self.curves[k];
                for m in 1..=CURVE_COEFFICIENTS / 2 {
                    // q becomes -conj(q).
                    let sign = if m % 2 == 1 { -1.0 } else { 1.0 };
                    curve[2 * m - 1] = curve[2 * m - 1].map(|value| sign * value);
                    curve[2 * m] = curve[2 * m].map(|value| -sign * value);
                }
                curve
            })
            .collect();
        self.pixels = order.iter().map(|&k| mirrored(self.pixels[k])).collect();
    }

    /// The same at half the width: means over blocks of 2 x 2 pixels, of those that are covered to a half.
    pub fn halved(&self) -> Self {
        let size = self.size / 2;
        let mut members: Vec<Vec<usize>> = vec![Vec::new(); (size * size) as usize];
        for (k, &pixel) in self.pixels.iter().enumerate() {
            let at = Vec2::new((pixel % self.size) as f32, (pixel / self.size) as f32) / 2.0;
            let (x, y) = (at.x as u32, at.y as u32);
            if x < size && y < size {
                members[(y * size + x) as usize].push(k);
            }
        }
        let mut half = Self {
            size,
            pixels: Vec::new(),
            curves: Vec::new(),
            elevation: self.elevation,
            normals: Vec::new(),
            albedo: Vec::new(),
        };
        for (block, members) in (0_u32..)
            .zip(&members)
            .filter(|(_, members)| members.len() >= 2)
        {
            let mut curve = [[0.0; 3]; CURVE_COEFFICIENTS];
            for &k in members {
                let pairs = curve
                    .as_flattened_mut()
                    .iter_mut()
                    .zip(self.curves[k].as_flattened());
                pairs.for_each(|(sum, value)| *sum += value / members.len() as f32);
            }
            let normal: Vec3 = members.iter().map(|&k| self.normals[k]).sum();
            half.pixels.push(block);
            half.curves.push(curve);
            half.normals.push(normal.normalize_or(Vec3::Z));
            let albedo: Vec3 = members.iter().map(|&k| self.albedo[k]).sum();
            half.albedo.push(albedo / members.len() as f32);
        }
        half
    }
}

impl TransferMaterial {
    /// Metal, or a diffuse surface with or without gloss.
    fn draw(random: &mut Random) -> Self {
        let is_metal = random.chance(METAL);
        let material = Self {
            is_metal,
            reflectance: 1.0,
            lobe: TransferLobe::Fresnel,
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
}

/// One of the view's finishes, mostly in its own colours, darker or brighter.
fn finish(view: &RadianceTransfer, random: &mut Random) -> TransferFinish {
    let Some(finish) = view.finishes.get(random.index(view.finishes.len())) else {
        return TransferFinish {
            normals: view.towards_eye.clone(),
            albedo: vec![Vec3::ONE; view.pixels.len()],
        };
    };
    let mut finish = finish.clone();
    if random.chance(PLAIN) {
        let tint = Vec3::from_array([(); 3].map(|()| (random.normal() * 0.3).exp()));
        let plain = (tint * random.log_uniform(0.05..0.9)).min(Vec3::splat(0.95));
        finish.albedo.fill(plain);
    } else {
        let darker = random.log_uniform(0.1..1.0);
        finish
            .albedo
            .iter_mut()
            .for_each(|albedo| *albedo *= darker);
    }
    finish
}

fn value_at(curve: &CurveCoefficients, c: usize, angle: f32) -> f32 {
    (1..=CURVE_COEFFICIENTS / 2).fold(curve[0][c], |sum, m| {
        let (sin, cos) = (m as f32 * angle).sin_cos();
        sum + curve[2 * m - 1][c] * cos - curve[2 * m][c] * sin
    })
}

fn angles() -> impl Iterator<Item = f32> {
    (0..ANGLES).map(|k| TAU * k as f32 / ANGLES as f32)
}

/// No value of the curve is above this.
fn brightest_of(curve: &CurveCoefficients) -> f32 {
    let most = |c: usize| {
        let swings =
            (1..=CURVE_COEFFICIENTS / 2).map(|m| curve[2 * m - 1][c].hypot(curve[2 * m][c]));
        curve[0][c] + swings.sum::<f32>()
    };
    (0..3).map(most).fold(0.0, f32::max)
}

/// The coefficients of a channel's curve where it is cut off at `white`.
fn clip_channel(curve: &mut CurveCoefficients, c: usize, white: f32) {
    let values: Vec<f32> = angles().map(|angle| value_at(curve, c, angle)).collect();
    if values.iter().all(|&value| value <= white) {
        return;
    }
    let share = 1.0 / ANGLES as f32;
    for (angle, value) in angles().zip(values).filter(|(_, value)| *value > white) {
        let cut = (value - white) * share;
        curve[0][c] -= cut;
        for m in 1..=CURVE_COEFFICIENTS / 2 {
            let (sin, cos) = (m as f32 * angle).sin_cos();
            curve[2 * m - 1][c] -= 2.0 * cut * cos;
            curve[2 * m][c] += 2.0 * cut * sin;
        }
    }
}
