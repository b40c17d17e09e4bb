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
    let curl = random.chance(0.4).then(|| Curl::draw(random));
    let mut raw = RawMesh::default();
    add_grid(&mut raw, CELLS, CELLS, |x, y| {
        let at = Vec2::new(x, y * narrowness);
        let folded: f32 = folds.iter().map(|fold| fold.height(at)).sum();
        let place = at.extend(0.0);
        let waved: f32 = waves.iter().map(|wave| wave.height(place)).sum();
        let place = at.extend(folded + waved);
        curl.as_ref().map_or(place, |curl| curl.bent(place))
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

/// The sheet rolled about an axis that lies in it, as pages, leaves and labels are.
struct Curl {
    along: Vec2,
    /// Radians a unit of length; towards the viewer where it is positive.
    curvature: f32,
}

impl Curl {
    fn draw(random: &mut Random) -> Self {
        let side = random.pick([-1.0, 1.0]);
        Self {
            along: Vec2::from_angle(random.uniform(0.0..std::f32::consts::TAU)),
            // At the edge of the sheet it faces at most 60 degrees aside.
            curvature: side * random.uniform(0.2..1.0),
        }
    }

    fn bent(&self, place: Vec3) -> Vec3 {
        let across = self.along.perp();
        let (length, height) = (place.truncate().dot(across), place.z);
        let (sin, cos) = (length * self.curvature).sin_cos();
        let turned = across * (sin / self.curvature - height * sin);
        let kept = self.along * place.truncate().dot(self.along);
        (kept + turned).extend((1.0 - cos) / self.curvature + height * cos)
    }
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
    // Each finer wave is flatter: slopes that change within a few pixels of a small picture cannot be learned from it.
    let octaves: &[(f32, f32)] = if is_alone {
        &[(1.0, 0.5), (2.0, 0.45), (4.0, 0.3), (8.0, 0.12)]
    } else {
        &[(4.0, 0.08)]
    };
    let wave = |&(frequency, steepest): &(f32, f32)| Wave {
        noise: Noise::new(random.seed(), frequency),
        height: random.uniform(0.0..steepest) / frequency,
        is_ridged: random.chance(0.25),
    };
    octaves.iter().map(wave).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::ShapeKind;

    /// Part of the neighbouring facets whose normals are more than 20 degrees apart.
    fn rough_part(kind: ShapeKind, seeds: u64) -> f64 {
        let (mut rough, mut all) = (0_u32, 0_u32);
        for seed in 0..seeds {
            let mesh = kind.build(seed);
            let normals: Vec<Vec3> = mesh
                .triangles
                .iter()
                .map(|corners| {
                    let [a, b, c] = corners.map(|v| mesh.positions[v as usize]);
                    (b - a).cross(c - a).normalize_or_zero()
                })
                .collect();
            for pair in normals.windows(2).step_by(2) {
                all += 1;
                rough += u32::from(pair[0].dot(pair[1]) < 0.94);
            }
        }
        f64::from(rough) / f64::from(all)
    }

    #[test]
    fn most_of_a_sheet_is_so_smooth_that_its_normals_can_be_seen_in_a_small_picture() {
        let rough = rough_part(ShapeKind::Sheet, 40);
        assert!(rough < 0.02, "{rough}");
    }

    #[test]
    fn a_curled_sheet_keeps_its_lengths() {
        let curl = Curl {
            along: Vec2::Y,
            curvature: 0.8,
        };
        let [a, b] = [0.5, 0.501].map(|x| curl.bent(Vec3::new(x, 0.3, 0.0)));
        assert!(((b - a).length() - 0.001).abs() < 1e-5);
        assert!((b - a).z.abs() > 1e-4);
    }
}
