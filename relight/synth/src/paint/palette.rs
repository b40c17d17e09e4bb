//! Which colours stand together on one object.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::super::random::Random;

/// What kind of albedo an object has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum AlbedoKind {
    /// One colour.
    Constant,
    /// Two colours that go over into one another.
    Gradient,
    /// Patterns of greys.
    Grey,
    /// Nearly white against dark, mostly dark and coloured.
    TwoTone,
    /// Print, dark and neutral mostly, on a white or coloured ground.
    Print,
    /// Patterns of two to five colours.
    Patterned,
    /// From the mesh's file.
    Own,
}

impl AlbedoKind {
    /// Each with its weight. Plain objects teach little about albedo; print and two tones are what shading is mistaken
    /// for.
    const WEIGHTS: [(Self, f32); 6] = [
        (Self::Constant, 0.10),
        (Self::Gradient, 0.05),
        (Self::Grey, 0.05),
        (Self::TwoTone, 0.40),
        (Self::Print, 0.18),
        (Self::Patterned, 0.22),
    ];

    pub(super) fn draw(random: &mut Random) -> Self {
        random.weighted(Self::WEIGHTS)
    }
}

/// The colours of print.
pub(super) struct Inks {
    pub(super) ground: Vec3,
    pub(super) label: Vec3,
    pub(super) ink: Vec3,
}

impl Inks {
    /// Dark ink on a white, grey or coloured ground mostly; some of it white on dark.
    pub(super) fn draw(random: &mut Random) -> Self {
        let paper = near_white(random);
        let ground = match random.weighted([(0, 0.45), (1, 0.45), (2, 0.1)]) {
            0 => paper,
            1 => brighter(random, 0.2, hue),
            _ => limited(Vec3::splat(random.uniform(0.25..0.6))),
        };
        let ink = match random.weighted([(0, 0.8), (1, 0.2)]) {
            0 => black(random),
            _ => darker(random, 0.2, hue),
        };
        if random.chance(0.12) {
            return Self {
                ground: ink,
                label: ink,
                ink: paper,
            };
        }
        let label = if random.chance(0.7) {
            near_white(random)
        } else {
            brighter(random, 0.25, colour)
        };
        Self { ground, label, ink }
    }
}

/// Black and dark grey, as ink is: hardly tinted.
fn black(random: &mut Random) -> Vec3 {
    let level = random.log_uniform(0.015..0.13);
    limited(Vec3::from_array(
        [(); 3].map(|()| level * (1.0 + random.normal() * 0.04)),
    ))
}

fn near_white(random: &mut Random) -> Vec3 {
    let level = random.uniform(0.6..0.95);
    limited(Vec3::from_array(
        [(); 3].map(|()| level * (1.0 + random.normal() * 0.04)),
    ))
}

/// The first draw that is on average at least this bright.
fn brighter(random: &mut Random, least: f32, draw: fn(&mut Random) -> Vec3) -> Vec3 {
    loop {
        let colour = draw(random);
        if colour.element_sum() / 3.0 >= least {
            return colour;
        }
    }
}

/// The first draw that is on average at most this bright.
fn darker(random: &mut Random, most: f32, draw: fn(&mut Random) -> Vec3) -> Vec3 {
    loop {
        let colour = draw(random);
        if colour.element_sum() / 3.0 <= most {
            return colour;
        }
    }
}

/// Two to five colours, linear.
pub(super) struct Palette {
    pub(super) colours: Vec<Vec3>,
}

impl Palette {
    pub(super) fn draw(random: &mut Random, kind: AlbedoKind) -> Self {
        let count = random.count(2..6);
        let mut colours: Vec<Vec3> = (0..count).map(|_| colour(random)).collect();
        match kind {
            AlbedoKind::TwoTone => {
                let (light, dark) = two_tones(random);
                let swapped = random.chance(0.5);
                colours[0] = if swapped { dark } else { light };
                colours[1] = if swapped { light } else { dark };
            }
            AlbedoKind::Grey => {
                for colour in &mut colours {
                    *colour = Vec3::splat(random.log_uniform(0.04..0.95));
                }
            }
            _ => {}
        }
        Self { colours }
    }
}

/// Any colour that things have: whites, blacks, greys, and hues of every strength.
fn colour(random: &mut Random) -> Vec3 {
    let (level, tint) = match random.weighted([(0, 0.33), (1, 0.05), (2, 0.05), (3, 0.57)]) {
        0 => (random.uniform(0.6..1.0), 0.03),
        1 => (random.uniform(0.03..0.25), 0.1),
        2 => (random.uniform(0.2..0.7), 0.05),
        _ => return hue(random),
    };
    let tinted = Vec3::from_array([(); 3].map(|()| level * (1.0 + random.normal() * tint)));
    limited(tinted)
}

fn hue(random: &mut Random) -> Vec3 {
    let turn = random.uniform(0.0..6.0);
    let saturation = random.uniform(0.25..0.95);
    let value = random.log_uniform(0.05..0.97);
    // The channels of the colour circle, as in the conversion from hue, saturation and value.
    let channel = |offset: f32| {
        let place = (offset + turn) % 6.0;
        value - value * saturation * place.min(4.0 - place).clamp(0.0, 1.0)
    };
    limited(Vec3::new(channel(5.0), channel(3.0), channel(1.0)))
}

/// Nearly white, and dark. A dark grey patch with a soft edge on white looks like a shadow, so most dark ones are
/// coloured; a quarter is not, as things are.
fn two_tones(random: &mut Random) -> (Vec3, Vec3) {
    let level = random.uniform(0.65..1.0);
    let light = Vec3::from_array([(); 3].map(|()| level * (1.0 + random.normal() * 0.04)));
    let must_be_coloured = random.chance(0.75);
    loop {
        let dark = colour(random);
        let chroma = (dark.max_element() - dark.min_element()) / dark.max_element();
        if dark.element_sum() / 3.0 < 0.35 && (!must_be_coloured || chroma > 0.35) {
            return (limited(light), dark);
        }
    }
}

fn limited(colour: Vec3) -> Vec3 {
    colour.clamp(Vec3::splat(0.015), Vec3::ONE)
}
