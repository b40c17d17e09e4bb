//! The material, light and camera of a photograph of a cast view: all its parameters except the noise.
//!
//! The chances of lamps, ambient light, gloss and cameras are those of [`Recipe`](crate::Recipe).

use glam::{Mat3, Vec3};
use relight_core::light::{Direction, Order, ShLight, basis};

use super::cast::table_frame;
use super::environment_lights::{EnvironmentLights, rotation};
use super::photo_view::{PhotoView, ViewLamp};
use crate::lighting::{BlinnPhong, tint};
use crate::random::Random;
use crate::samples::camera::{CameraModel, Response};

/// Part of the photographs whose main light is a lamp.
const BY_LAMP: f32 = 0.8;
/// Part of these whose surroundings give even light, as a laboratory with black walls does; a room is around the others.
const EVEN_BESIDE_LAMPS: f32 = 0.6;
/// Part of the surfaces with gloss.
const GLOSSY: f32 = 0.35;
/// Part of these with coloured highlights.
const COLOURED_GLOSS: f32 = 0.2;
/// Part of the surfaces of one colour.
const PLAIN: f32 = 0.2;
/// Part of the others whose hues are others than the material's.
const OTHER_HUES: f32 = 0.2;
/// Part of them with the colours of a second material printed on them.
const PRINTED: f32 = 0.3;
/// Part of the cameras without noise and compression, whose response is sRGB.
const PLAIN_CAMERA: f32 = 0.5;
/// Part of the pictures whose values are read as sRGB, whatever the camera's response: the user of a photograph does not know
/// it either. Hardly more, as albedo times shading is not such a picture.
const TAKEN_AS_SRGB: f32 = 0.1;
/// Part of the cameras, but for the plain ones, whose pictures are not quite sharp.
const BLURRED: f32 = 0.4;
/// Part of the exposures that clip.
const CLIPPED: f32 = 0.15;

/// A photograph of a view.
#[derive(Debug, Clone, PartialEq)]
pub struct PhotoPlan {
    /// Which of the view's materials.
    pub finish: usize,
    /// Takes its albedo into another colour: linear, column by column.
    pub recolour: [[f32; 3]; 3],
    /// The power of that albedo.
    pub contrast: f32,
    /// The one colour of a surface that has only one; 0 where it has more.
    pub plain: [f32; 3],
    /// The print on it.
    pub print: Option<PhotoPrint>,
    /// The lamps.
    pub lamps: Vec<PhotoLamp>,
    /// Light from all around, in harmonics of the viewer's frame, [`PhotoView::ORDER`].
    pub room: Vec<[f32; 3]>,
    /// All light but what bounces, in nine harmonics.
    pub light: [[f32; 3]; 9],
    /// How much of the light that the object throws onto itself counts.
    pub bounce: [f32; 3],
    /// Its highlights.
    pub gloss: Option<PhotoGloss>,
    /// The camera.
    pub camera: PhotoCamera,
}

/// A print: the albedo of another material of the view where waves on the object's own points add up to more than a level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhotoPrint {
    /// Which material.
    pub finish: usize,
    /// Three waves, each a wave vector and a phase.
    pub waves: [[f32; 4]; 3],
    /// The level, -3..3.
    pub level: f32,
}

/// A lamp of the view that is lit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhotoLamp {
    /// Which one.
    pub lamp: usize,
    /// Irradiance, at the origin, of a surface that faces it.
    pub irradiance: [f32; 3],
}

/// Blinn and Phong's highlight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhotoGloss {
    /// Its strength.
    pub reflectance: [f32; 3],
    /// Its exponent.
    pub exponent: f32,
}

/// A camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhotoCamera {
    /// White balance.
    pub balance: [f32; 3],
    /// To which the brightest channel of 99 in 100 pixels is exposed; 1 clips.
    pub level: f32,
    /// Of the response, the power `1 / gamma`; none: sRGB.
    pub gamma: Option<f32>,
    /// Whether the picture's values are read as sRGB afterwards.
    pub taken_as_srgb: bool,
    /// Standard deviation of the noise that does not depend on light.
    pub read_noise: f32,
    /// Standard deviation of shot noise at the clipping level.
    pub shot_noise: f32,
    /// Standard deviation of its blur, pixels.
    pub blur: f32,
    /// Quality of the JPEG compression, and whether colours have half the resolution.
    pub jpeg: Option<(u8, bool)>,
}

impl PhotoPlan {
    /// The photograph of a seed, of a view with these lamps, in one of these rooms.
    pub fn draw(seed: u64, lamps: &[ViewLamp], rooms: &EnvironmentLights) -> Self {
        let mut random = Random::new(seed);
        let by_lamp = random.chance(BY_LAMP);
        let (lit, ambient, bounce) = draw_light(&mut random, by_lamp, lamps.len());
        let around = if by_lamp && random.chance(EVEN_BESIDE_LAMPS) {
            ShLight::even(PhotoView::ORDER, [1.0; 3])
        } else {
            draw_room(&mut random, rooms)
        };
        let room: Vec<[f32; 3]> = around
            .coefficients()
            .iter()
            .map(|c| [0, 1, 2].map(|channel| c[channel] as f32 * ambient[channel]))
            .collect();
        let finish = random.index(PhotoView::FINISHES);
        let (recolour, contrast, plain) = draw_colours(&mut random);
        let print = (plain == [0.0; 3] && random.chance(PRINTED)).then(|| draw_print(&mut random));
        Self {
            finish,
            recolour,
            contrast,
            plain,
            print,
            light: all_light(&room, &lit, lamps),
            lamps: lit,
            room,
            bounce: bounce.to_array(),
            gloss: random.chance(GLOSSY).then(|| draw_gloss(&mut random)),
            camera: PhotoCamera::draw(&mut random),
        }
    }
}

/// Lamps, the irradiance of light from all around, and what of the bounced light counts.
fn draw_light(random: &mut Random, by_lamp: bool, lamps: usize) -> (Vec<PhotoLamp>, Vec3, Vec3) {
    let mut lit = Vec::new();
    let mut add = |random: &mut Random, strength: f32| {
        if lamps > 0 {
            lit.push(PhotoLamp {
                lamp: random.index(lamps),
                irradiance: (tint(random, 0.12) * strength).to_array(),
            });
        }
    };
    let ambient = if by_lamp {
        let (count, most) = random.weighted([((1, 0.25), 0.75), ((2, 0.3), 0.15), ((3, 0.3), 0.1)]);
        for _ in 0..count {
            let strength = if count == 1 {
                1.0
            } else {
                random.uniform(0.2..1.0)
            };
            add(random, strength);
        }
        let nearly_none = random.chance(0.4);
        random.uniform(0.0..if nearly_none { 0.04 } else { most })
    } else {
        if random.chance(0.4) {
            let strength = random.uniform(0.3..2.0);
            add(random, strength);
        }
        1.0
    };
    // Another tint than the lamp's: shaded parts shift in colour.
    let ambient = tint(random, 0.15) * ambient / std::f32::consts::PI;
    let bounce = tint(random, 0.15) * random.uniform(0.0..1.0);
    (lit, ambient, bounce)
}

/// A room around the viewer, of mean radiance 1: mostly upright, as seen from somewhat above.
fn draw_room(random: &mut Random, rooms: &EnvironmentLights) -> ShLight {
    let room = rooms.draw(random.seed()).with_order(PhotoView::ORDER);
    let into_view = if random.chance(0.7) {
        table_frame(random.uniform(-0.1..0.8)).transpose()
    } else {
        random.rotation()
    };
    room.rotated(&rotation(into_view))
}

/// Room and lamps as nine harmonics.
fn all_light(room: &[[f32; 3]], lit: &[PhotoLamp], lamps: &[ViewLamp]) -> [[f32; 3]; 9] {
    let mut light = [[0.0; 3]; 9];
    for (to, from) in light.iter_mut().zip(room) {
        *to = *from;
    }
    for lamp in lit {
        let [x, y, z] = lamps[lamp.lamp].centre.map(f64::from);
        let Some(towards) = Direction::new(x, y, z) else {
            continue;
        };
        for (to, value) in light.iter_mut().zip(basis(Order::TWO, towards)) {
            for (to, irradiance) in to.iter_mut().zip(lamp.irradiance) {
                *to += value as f32 * irradiance;
            }
        }
    }
    light
}

/// How the material's colours are changed: mixed and scaled, in another contrast, or made one.
fn draw_colours(random: &mut Random) -> ([[f32; 3]; 3], f32, [f32; 3]) {
    let tint = Vec3::from_array([(); 3].map(|()| (random.normal() * 0.15).exp()));
    let mut mix = Mat3::from_diagonal(tint);
    if random.chance(OTHER_HUES) {
        // Turned about grey: other hues, as bright.
        let grey = Vec3::ONE.normalize();
        mix *= Mat3::from_axis_angle(grey, random.uniform(0.0..std::f32::consts::TAU));
    }
    let brightness = if random.chance(0.5) {
        1.0
    } else {
        random.log_uniform(0.25..1.5)
    };
    let plain = if random.chance(PLAIN) {
        let colour = Vec3::from_array([(); 3].map(|()| (random.normal() * 0.3).exp()));
        (colour * random.log_uniform(0.05..0.9)).min(Vec3::splat(0.95))
    } else {
        Vec3::ZERO
    };
    let contrast = random.uniform(0.7..1.3);
    let columns = (mix * brightness).to_cols_array_2d();
    (columns, contrast, plain.to_array())
}

fn draw_print(random: &mut Random) -> PhotoPrint {
    let frequency = random.log_uniform(2.0..25.0);
    PhotoPrint {
        finish: random.index(PhotoView::FINISHES),
        waves: [(); 3].map(|()| {
            let wave = random.direction() * frequency * random.uniform(0.6..1.6);
            let phase = random.uniform(0.0..std::f32::consts::TAU);
            wave.extend(phase).to_array()
        }),
        level: random.uniform(-0.8..1.6),
    }
}

fn draw_gloss(random: &mut Random) -> PhotoGloss {
    let (strength, exponent) = BlinnPhong::draw_strength(random);
    let colour = if random.chance(COLOURED_GLOSS) {
        let colour = Vec3::from_array([(); 3].map(|()| (random.normal() * 0.3).exp()));
        colour / colour.max_element()
    } else {
        Vec3::ONE
    };
    PhotoGloss {
        reflectance: (colour * strength).to_array(),
        exponent,
    }
}

impl PhotoCamera {
    fn draw(random: &mut Random) -> Self {
        let level = if random.chance(CLIPPED) {
            random.uniform(1.1..1.8)
        } else {
            random.uniform(0.6..1.1)
        };
        let taken_as_srgb = random.chance(TAKEN_AS_SRGB);
        let plain = random.chance(PLAIN_CAMERA);
        let camera = if plain {
            CameraModel::plain()
        } else {
            CameraModel::draw(random)
        };
        let blur = if !plain && random.chance(BLURRED) {
            random.uniform(0.3..0.8)
        } else {
            0.0
        };
        Self {
            balance: camera.gain.to_array(),
            level,
            gamma: match camera.response {
                Response::Srgb => None,
                Response::Power { gamma } => Some(gamma),
            },
            taken_as_srgb,
            read_noise: camera.read_noise,
            shot_noise: camera.shot_noise,
            blur,
            jpeg: camera.jpeg.map(|quality| (quality, random.chance(0.5))),
        }
    }
}
