//! Panoramas from a seed: a studio with soft boxes, a room with a window, a sky, even
//! light. Knows directions only.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::noise::Noise;
use crate::random::{Random, stream};
use crate::vectors::vector;
use relight_core::image::{Extent, Planes, Rgb};
use relight_core::light::{LightError, Panorama};

/// A kind of panorama that is made here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Surroundings {
    /// A dark room with two to four soft boxes.
    Studio,
    /// A room with a window by day, and a lamp.
    Room,
    /// Ground below, sky above, with a sun that is clear or behind clouds.
    Sky,
    /// Nearly the same light from everywhere.
    Even,
}

impl Surroundings {
    /// All kinds.
    pub(crate) const ALL: [Self; 4] = [Self::Studio, Self::Room, Self::Sky, Self::Even];

    /// The name, as in file names.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Studio => "studio",
            Self::Room => "room",
            Self::Sky => "sky",
            Self::Even => "even",
        }
    }

    /// The panorama of this kind and seed, linear radiance.
    ///
    /// # Errors
    /// [`LightError::Empty`] if `extent` has no pixels.
    pub(crate) fn panorama(self, seed: u64, extent: Extent) -> Result<Panorama, LightError> {
        let mut random = Random::new(stream(seed, self as u64));
        let place: Box<dyn Fn(Vec3) -> Vec3> = match self {
            Self::Studio => Box::new(studio(&mut random)),
            Self::Room => Box::new(room(&mut random)),
            Self::Sky => Box::new(sky(&mut random)),
            Self::Even => Box::new(even(&mut random)),
        };
        // The frame is that of panoramas: their own pixels tell their directions.
        let frame = Panorama::new(Rgb::new(Planes::zeros(extent)))?;
        let radiance = |x: usize, y: usize| {
            // Four places a pixel: edges of windows and soft boxes are not jagged.
            let places = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)];
            let colours =
                places.map(|(dx, dy)| place(vector(frame.direction(x as f64 + dx, y as f64 + dy))));
            (colours.iter().sum::<Vec3>() / 4.0).to_array()
        };
        Panorama::new(Rgb::new(Planes::from_fn(extent, radiance)))
    }
}

/// A warm (towards 1) or cool (towards -1) white.
fn white(warmth: f32) -> Vec3 {
    Vec3::new(1.0 + 0.25 * warmth, 1.0, 1.0 - 0.35 * warmth)
}

fn studio(random: &mut Random) -> impl Fn(Vec3) -> Vec3 + use<> {
    let (walls, floor) = (random.uniform(0.02..0.12), random.uniform(0.05..0.25));
    let boxes: Vec<SoftBox> = (0..random.count(2..5))
        .map(|_| SoftBox::draw(random))
        .collect();
    move |towards| {
        let ground = if towards.y < 0.0 { floor } else { walls };
        let dark = Vec3::splat(ground * (0.7 + 0.3 * towards.y.abs()));
        boxes
            .iter()
            .fold(dark, |sum, soft_box| sum + soft_box.radiance(towards))
    }
}

/// A lit rectangle, brighter in its middle.
struct SoftBox {
    towards: Vec3,
    right: Vec3,
    up: Vec3,
    radiance: Vec3,
}

impl SoftBox {
    fn draw(random: &mut Random) -> Self {
        let mut towards = random.direction();
        towards.y = towards.y.abs() * 0.9 + 0.1;
        let towards = towards.normalize();
        let level = towards.cross(Vec3::Y).normalize_or(Vec3::X);
        let (width, height) = (random.uniform(0.15..0.6), random.uniform(0.15..0.6));
        Self {
            towards,
            right: level / width,
            up: level.cross(towards) / height,
            radiance: white(random.uniform(-0.4..0.4)) * random.log_uniform(4.0..30.0),
        }
    }

    fn radiance(&self, towards: Vec3) -> Vec3 {
        let along = towards.dot(self.towards);
        if along <= 0.05 {
            return Vec3::ZERO;
        }
        let flat = towards / along;
        let (x, y) = (flat.dot(self.right).abs(), flat.dot(self.up).abs());
        if x.max(y) > 1.0 {
            return Vec3::ZERO;
        }
        self.radiance * (1.0 - 0.35 * (x * x + y * y) / 2.0)
    }
}

fn room(random: &mut Random) -> impl Fn(Vec3) -> Vec3 + use<> {
    let half = Vec3::new(random.uniform(2.0..4.0), 1.4, random.uniform(2.0..4.0));
    let wall = white(random.uniform(-0.3..0.6)) * random.uniform(0.15..0.5);
    let floor = Vec3::new(0.5, 0.35, 0.22) * random.uniform(0.2..0.7);
    let ceiling = Vec3::splat(random.uniform(0.3..0.7));
    let window_wall = random.index(4);
    let (centre, width) = (random.uniform(-0.4..0.4), random.uniform(0.25..0.55));
    let outside = white(random.uniform(-0.8..-0.1)) * random.log_uniform(6.0..25.0);
    let lamp = Vec3::new(random.uniform(-1.0..1.0), 1.1, random.uniform(-1.0..1.0)).normalize();
    let lamp_light = white(0.8)
        * if random.chance(0.5) {
            random.uniform(8.0..30.0)
        } else {
            0.0
        };
    move |towards| {
        if towards.dot(lamp) > 0.992 && lamp_light != Vec3::ZERO {
            return lamp_light;
        }
        // Where a ray from the middle of the room meets its box.
        let reach = (half / towards.abs().max(Vec3::splat(1e-4))).min_element();
        let at = towards * reach;
        if at.y > half.y - 1e-3 {
            return ceiling;
        }
        if at.y < 1e-3 - half.y {
            return floor;
        }
        let is_side = half.x - at.x.abs() < 1e-3;
        let (along, number) = if is_side {
            (at.z / half.z, usize::from(at.x > 0.0))
        } else {
            (at.x / half.x, 2 + usize::from(at.z > 0.0))
        };
        let (x, y) = ((along - centre) / width, (at.y - 0.15) / 0.95);
        let is_window = number == window_wall && x.abs() < 1.0 && y.abs() < 1.0;
        let is_bar = x.abs() < 0.04 || y.abs() < 0.04 || x.abs().max(y.abs()) > 0.94;
        match (is_window, is_bar) {
            // Brighter above, where the sky is.
            (true, false) => outside * (0.7 + 0.3 * y),
            _ => wall * (0.75 + 0.25 * (at.y / half.y)),
        }
    }
}

fn sky(random: &mut Random) -> impl Fn(Vec3) -> Vec3 + use<> {
    let height = random.uniform(0.08..0.95);
    let around = random.uniform(0.0..std::f32::consts::TAU);
    let level = (1.0 - height * height).sqrt();
    let sun = Vec3::new(level * around.cos(), height, level * around.sin());
    let clouds = Noise::new(random.seed(), 2.5);
    let cover = random.uniform(-0.3..0.5);
    // A low sun is yellow, and weaker.
    let sun_light = white(1.4 * (1.0 - height).powi(2)) * 900.0 * (0.15 + height);
    let ground = Vec3::new(0.30, 0.26, 0.18) * random.uniform(0.3..1.5) * (0.3 + height);
    move |towards| {
        if towards.y < 0.0 {
            return ground * (1.0 + 0.4 * towards.y);
        }
        let blue =
            Vec3::new(0.25, 0.5, 1.0).lerp(Vec3::new(0.9, 1.0, 1.1), (1.0 - towards.y).powi(4));
        let glow = towards.dot(sun).max(0.0).powi(40) * 3.0;
        // Clouds lie in a layer: nearer to the horizon they are smaller.
        let layer = towards / (towards.y + 0.15);
        let cloud = ((clouds.at(layer * Vec3::new(1.0, 0.0, 1.0)) + cover) * 3.0).clamp(0.0, 1.0);
        let clear = blue + Vec3::new(1.0, 0.95, 0.85) * glow;
        // The sun's disc is drawn as large as a few pixels, with as much less radiance.
        let disc = if towards.dot(sun) > 0.9985 {
            sun_light
        } else {
            Vec3::ZERO
        };
        let veil = 1.0 - cloud;
        clear.lerp(Vec3::splat(1.4 * (0.5 + 0.5 * height)), cloud * 0.9) + disc * veil * veil * veil
    }
}

fn even(random: &mut Random) -> impl Fn(Vec3) -> Vec3 + use<> {
    let lighter = random.direction() * random.uniform(0.0..0.15);
    let colour = white(random.uniform(-0.2..0.2));
    move |towards| colour * (1.0 + lighter.dot(towards))
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::light::Order;

    const EXTENT: Extent = Extent::new(64, 32);

    fn brightest(panorama: &Panorama) -> f32 {
        let planes = panorama.image().planes().planes();
        planes.into_iter().flatten().copied().fold(0.0, f32::max)
    }

    #[test]
    fn every_kind_is_a_light_of_its_own_for_each_seed() {
        for kind in Surroundings::ALL {
            let [a, b, c] = [1, 1, 2].map(|seed| kind.panorama(seed, EXTENT).unwrap());
            assert_eq!(a, b, "{kind:?}");
            assert_ne!(a, c, "{kind:?}");
            let planes = a.image().planes().planes();
            assert!(
                planes.into_iter().flatten().all(|&value| value >= 0.0),
                "{kind:?}"
            );
            assert!(a.project(Order::TWO).coefficients()[0][1] > 0.0, "{kind:?}");
        }
    }

    #[test]
    fn even_light_is_even_and_the_others_have_lamps() {
        for seed in 0..5 {
            let even = Surroundings::Even.panorama(seed, EXTENT).unwrap();
            assert!(brightest(&even) < 1.6);
            for kind in [Surroundings::Studio, Surroundings::Room] {
                assert!(
                    brightest(&kind.panorama(seed, EXTENT).unwrap()) > 3.0,
                    "{kind:?} {seed}"
                );
            }
        }
    }

    #[test]
    fn the_sky_is_above() {
        for seed in 0..5 {
            let light = Surroundings::Sky
                .panorama(seed, EXTENT)
                .unwrap()
                .project(Order::TWO);
            assert!(light.coefficients()[1][2] > 0.0, "{seed}");
        }
    }

    #[test]
    fn a_panorama_without_pixels_is_refused() {
        assert_eq!(
            Surroundings::Sky.panorama(0, Extent::new(0, 5)),
            Err(LightError::Empty)
        );
    }
}
