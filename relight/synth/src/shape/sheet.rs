//! Sheets: folded along straight lines as paper is, or in waves and ridges.

use glam::{Vec2, Vec3};

use super::super::mesh::RawMesh;
use super::super::noise::Noise;
use super::super::random::Random;
use super::surface::add_grid;

/// Cells along each side.
const CELLS: u32 = 110;

/// A random sheet that faces +z.
pub(super) fn draw(random: &mut Random) -> RawMesh {
    let narrowness = random.uniform(0.6..1.0);
    let folds = if random.chance(0.5) {
        folds(random)
    } else {
        Vec::new()
    };
    let waves = waves(random, folds.is_empty());
    let mut raw = RawMesh::default();
    add_grid(&mut raw, CELLS, CELLS, |x, y| {
        let at = Vec2::new(x, y * narrowness);
        let folded: f32 = folds.iter().map(|fold| fold.height(at)).sum();
        let place = at.extend(0.0);
        let waved: f32 = waves.iter().map(|wave| wave.height(place)).sum();
        at.extend(folded + waved)
    });
    raw
}

/// A flat square that faces +z.
pub(super) fn flat() -> RawMesh {
    let mut raw = RawMesh::default();
    add_grid(&mut raw, 1, 1, |x, y| Vec3::new(x, y, 0.0));
    raw
}

/// A crease: the height grows with the distance from a line.
struct Fold {
    across: Vec2,
    offset: f32,
    slope: f32,
}

impl Fold {
    fn height(&self, at: Vec2) -> f32 {
        (at.dot(self.across) - self.offset).abs() * self.slope
    }
}

fn folds(random: &mut Random) -> Vec<Fold> {
    let count = random.count(2..14);
    let strength = random.uniform(0.2..0.7) / (count as f32).sqrt();
    let fold = |_| Fold {
        across: Vec2::from_angle(random.uniform(0.0..std::f32::consts::TAU)),
        offset: random.uniform(-0.9..0.9),
        slope: random.normal() * strength,
    };
    (0..count).map(fold).collect()
}

struct Wave {
    noise: Noise,
    height: f32,
    is_ridged: bool,
}

impl Wave {
    fn height(&self, at: Vec3) -> f32 {
        let value = self.noise.at(at);
        self.height
            * if self.is_ridged {
                1.0 - 2.0 * value.abs()
            } else {
                value
            }
    }
}

fn waves(random: &mut Random, is_alone: bool) -> Vec<Wave> {
    let frequencies: &[f32] = if is_alone {
        &[1.5, 4.0, 8.0, 16.0]
    } else {
        &[4.0]
    };
    let highest = if is_alone { 0.5 } else { 0.08 };
    let wave = |&frequency: &f32| Wave {
        noise: Noise::new(random.seed(), frequency),
        height: random.uniform(0.0..highest) / frequency.max(1.0),
        is_ridged: random.chance(0.4),
    };
    frequencies.iter().map(wave).collect()
}
