//! Albedo and relief out of nothing but a seed: patterns in space that stick to the surface. Knows
//! points and normals, neither light nor cameras.
//!
//! | file | concern |
//! | --- | --- |
//! | `frame` | planes to draw on, soft edges |
//! | `palette` | which colours stand together |
//! | `pattern` | which points have which colour of the palette |
//! | `mark` | printed forms |
//! | `print` | labels, glyphs, logos and bar codes in ink |
//! | `writing` | lines of strokes that look like a script |
//! | `relief` | slopes that are finer than the mesh |

mod frame;
mod mark;
mod palette;
mod pattern;
mod print;
mod relief;
mod writing;

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::noise::Noise;
use super::random::{Random, stream};
use super::texture::TextureImage;
use palette::{Inks, Palette};
use pattern::{Canvas, Pattern};

pub(crate) use palette::AlbedoKind;
pub(crate) use relief::Relief;

/// Least albedo of anything: soot reflects more.
const DARKEST: f32 = 0.01;

/// The albedo of a surface: a ground and patterns over it, one over the other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Paint {
    /// What it was drawn as.
    pub kind: AlbedoKind,
    /// Linear red, green and blue of the ground, 0..=1.
    pub ground: Vec3,
    coats: Vec<Coat>,
    warp: Option<Warp>,
    mottle: Option<Mottle>,
}

/// A pattern in a colour.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Coat {
    colour: Vec3,
    pattern: Pattern,
}

/// Patterns are bent by noise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Warp {
    seed: u64,
    frequency: f32,
    distance: f32,
}

/// The albedo is a little lighter and darker from place to place.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Mottle {
    seed: u64,
    frequency: f32,
    strength: f32,
}

impl Paint {
    /// One colour everywhere.
    pub(crate) fn constant(albedo: [f32; 3]) -> Self {
        Self {
            kind: AlbedoKind::Constant,
            ground: Vec3::from_array(albedo),
            coats: Vec::new(),
            warp: None,
            mottle: None,
        }
    }

    /// The mesh's own albedo; `mean` is its mean.
    pub(super) fn own(mean: Vec3) -> Self {
        Self {
            kind: AlbedoKind::Own,
            ground: mean,
            ..Self::constant([0.0; 3])
        }
    }

    /// A random paint for an object on which `points` lie; `pictures` is the number of pictures to
    /// choose from.
    pub(super) fn draw(random: &mut Random, points: &[Vec3], pictures: usize) -> Self {
        let kind = AlbedoKind::draw(random);
        Self::from_kind(random, kind, points, pictures)
    }

    fn from_kind(random: &mut Random, kind: AlbedoKind, points: &[Vec3], pictures: usize) -> Self {
        if kind == AlbedoKind::Print {
            return Self::printed(random, points);
        }
        let palette = Palette::draw(random, kind);
        if kind == AlbedoKind::Constant {
            return Self::constant(palette.colours[0].to_array());
        }
        let canvas = Canvas {
            points,
            palette: &palette,
            pictures,
        };
        let mut coats = Vec::new();
        if kind == AlbedoKind::Gradient || random.chance(0.25) {
            coats.push(Coat {
                colour: palette.colours[1],
                pattern: Pattern::gradient(random),
            });
        }
        let layers = match kind {
            AlbedoKind::Gradient => 0,
            _ => random.weighted([(1, 0.48), (2, 0.35), (3, 0.17)]),
        };
        for layer in 0..layers {
            let colour = palette.colours[(layer + 1) % palette.colours.len()];
            let pattern = Pattern::draw(random, &canvas);
            coats.push(Coat { colour, pattern });
        }
        Self {
            kind,
            ground: palette.colours[0],
            coats,
            warp: random.chance(0.5).then(|| Warp {
                seed: random.seed(),
                frequency: random.uniform(2.0..6.0),
                distance: random.uniform(0.01..0.1),
            }),
            mottle: random.chance(0.25).then(|| Mottle {
                seed: random.seed(),
                frequency: random.log_uniform(1.0..30.0),
                strength: random.uniform(0.0..0.15),
            }),
        }
    }

    /// Print on a ground. Neither bent nor mottled: ink is even.
    fn printed(random: &mut Random, points: &[Vec3]) -> Self {
        let inks = Inks::draw(random);
        Self {
            kind: AlbedoKind::Print,
            ground: inks.ground,
            coats: print::draw(random, points, &inks)
                .into_iter()
                .map(|(colour, pattern)| Coat { colour, pattern })
                .collect(),
            warp: None,
            mottle: None,
        }
    }

    /// The albedo at these points of an object (in its own frame, within the unit sphere), linear,
    /// 0.01..=1. `texture` are their texture coordinates, where there are any.
    pub(crate) fn apply(
        &self,
        points: &[Vec3],
        texture: Option<&[Vec2]>,
        pictures: &[TextureImage],
    ) -> Vec<Vec3> {
        let mut albedo = vec![self.ground; points.len()];
        if !self.coats.is_empty() {
            let bent: Vec<Vec3> = match self.warp {
                Some(warp) => points.iter().map(|&point| warp.bend(point)).collect(),
                None => points.to_vec(),
            };
            for coat in &self.coats {
                coat.pattern
                    .paint(coat.colour, &bent, texture, pictures, &mut albedo);
            }
        }
        if let Some(mottle) = self.mottle {
            let noise = Noise::new(mottle.seed, mottle.frequency);
            for (value, &point) in albedo.iter_mut().zip(points) {
                *value *= (noise.at(point) * mottle.strength).exp();
            }
        }
        for value in &mut albedo {
            *value = possible(*value);
        }
        albedo
    }
}

/// The nearest albedo that a surface can have.
pub(super) fn possible(albedo: Vec3) -> Vec3 {
    albedo.clamp(Vec3::splat(DARKEST), Vec3::ONE)
}

impl Warp {
    fn bend(self, point: Vec3) -> Vec3 {
        let noise = Noise::new(stream(self.seed, 1), self.frequency);
        point + noise.sloped(point).gradient * (self.distance / self.frequency)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points() -> Vec<Vec3> {
        let mut random = Random::new(8);
        (0..2000).map(|_| random.direction()).collect()
    }

    #[test]
    fn kinds_come_as_often_as_the_recipe_says_and_every_albedo_is_one_that_exists() {
        let points = points();
        let mut random = Random::new(1);
        let pictures = [TextureImage::from_fn(4, 4, |x, y| {
            Vec3::new(x as f32, y as f32, 1.0)
        })];
        let mut counts = std::collections::HashMap::new();
        for _ in 0..600 {
            let paint = Paint::draw(&mut random, &points, pictures.len());
            let albedo = paint.apply(&points, None, &pictures);
            assert!(
                albedo
                    .iter()
                    .all(|a| a.min_element() >= DARKEST && a.max_element() <= 1.0)
            );
            let is_constant = albedo.iter().all(|a| *a == albedo[0]);
            assert!(is_constant || paint.kind != AlbedoKind::Constant);
            *counts.entry(format!("{:?}", paint.kind)).or_insert(0) += 1;
        }
        // Within three standard deviations.
        let plain = counts["Constant"] + counts["Gradient"];
        assert!((63..117).contains(&plain), "{counts:?}");
        assert!((204..276).contains(&counts["TwoTone"]), "{counts:?}");
        assert!((80..136).contains(&counts["Print"]), "{counts:?}");
    }

    #[test]
    fn print_is_dark_and_neutral_mostly_and_covers_a_part_of_what_it_is_on() {
        let points = points();
        let mut random = Random::new(12);
        let (mut inked, mut neutral, mut covered) = (0, 0, 0.0);
        for _ in 0..200 {
            let paint = Paint::from_kind(&mut random, AlbedoKind::Print, &points, 0);
            let albedo = paint.apply(&points, None, &[]);
            let grey = |a: &Vec3| a.element_sum() / 3.0;
            let lightest = albedo.iter().map(grey).fold(0.0, f32::max);
            let is_dark = |a: &&Vec3| grey(a) < 0.3 * lightest;
            let dark: Vec<&Vec3> = albedo.iter().filter(is_dark).collect();
            let part = dark.len() as f32 / albedo.len() as f32;
            let chroma = |a: &&&Vec3| (a.max_element() - a.min_element()) / a.max_element();
            inked += usize::from(part > 0.005);
            covered += part;
            let greys = dark.iter().filter(|a| chroma(a) < 0.25).count();
            neutral += usize::from(!dark.is_empty() && 2 * greys > dark.len());
        }
        assert!(inked > 150, "{inked}");
        assert!(neutral > 110, "{neutral}");
        assert!((0.03..0.5).contains(&(covered / 200.0)), "{covered}");
    }

    #[test]
    fn two_tones_differ_strongly() {
        let mut random = Random::new(2);
        for _ in 0..50 {
            let palette = Palette::draw(&mut random, AlbedoKind::TwoTone);
            let [a, b] = [0, 1].map(|k| palette.colours[k].element_sum() / 3.0);
            assert!(a.max(b) > 1.5 * a.min(b), "{a} {b}");
        }
    }

    #[test]
    fn a_paint_comes_back_from_its_json() {
        let points = points();
        let mut random = Random::new(3);
        for _ in 0..40 {
            let paint = Paint::draw(&mut random, &points, 3);
            let text = serde_json::to_string(&paint).unwrap();
            let back: Paint = serde_json::from_str(&text).unwrap();
            assert_eq!(back, paint);
        }
    }
}
