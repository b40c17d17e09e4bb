//! Lines of strokes that look like a script: print on packages, signs, scribbles.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::super::random::{Random, mix, unit_of};
use super::frame::{Frame, step};

/// Corners of strokes in a letter: columns and rows of a lattice.
const LATTICE: [f32; 2] = [3.0, 5.0];
/// Strokes a letter.
const STROKES: u64 = 4;

/// A few lines of letters around a point of the surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Writing {
    frame: Frame,
    seed: u64,
    /// Letters across and lines down.
    letters: [u32; 2],
    /// Half of a stroke's width, in letters.
    weight: f32,
}

impl Writing {
    pub(super) fn draw(random: &mut Random, around: Vec3) -> Self {
        let scale = random.log_uniform(0.05..0.35);
        Self {
            frame: Frame::draw(random, around, scale),
            seed: random.seed(),
            letters: [random.count(2..10) as u32, random.count(1..4) as u32],
            weight: random.uniform(0.05..0.13),
        }
    }

    /// Lines of letters that fill a rectangle of a frame, from edge to edge.
    pub(super) fn filling(random: &mut Random, frame: &Frame, half: Vec2, lines: u32) -> Self {
        // A line is as high as 1.8 letters are wide.
        let width = 2.0 * half.y / (1.8 * lines.max(1) as f32);
        let across = (2.0 * half.x / width).floor().clamp(1.0, 24.0);
        Self {
            frame: frame.shifted(Vec2::ZERO, width),
            seed: random.seed(),
            letters: [across as u32, lines.max(1)],
            weight: random.uniform(0.07..0.2),
        }
    }

    /// How much ink there is at a point, 0..=1.
    pub(super) fn coverage(&self, point: Vec3) -> f32 {
        // Lines are somewhat farther apart than letters.
        let place = self.frame.place(point) / Vec2::new(1.0, 1.8)
            + Vec2::new(self.letters[0] as f32, self.letters[1] as f32) / 2.0;
        let cell = place.floor();
        let is_on = cell.x >= 0.0
            && cell.y >= 0.0
            && cell.x < self.letters[0] as f32
            && cell.y < self.letters[1] as f32;
        if !is_on {
            return 0.0;
        }
        let letter = mix(self.seed ^ ((cell.y as u64) << 32 | cell.x as u64));
        // One in eight is a space between words.
        if letter.is_multiple_of(8) {
            return 0.0;
        }
        let inside = (place - cell) * Vec2::new(1.0, 1.8);
        let distances = (0..STROKES).map(|k| stroke(letter, k).distance(inside));
        let nearest = distances.fold(f32::INFINITY, f32::min);
        step(self.weight - nearest, 0.04)
    }
}

struct Stroke {
    from: Vec2,
    to: Vec2,
}

impl Stroke {
    fn distance(&self, place: Vec2) -> f32 {
        let along = self.to - self.from;
        let part = (place - self.from).dot(along) / along.length_squared().max(1e-6);
        place.distance(self.from + along * part.clamp(0.0, 1.0))
    }
}

/// One stroke of a letter, between neighbouring corners mostly, and each from where the last ended.
fn stroke(letter: u64, number: u64) -> Stroke {
    let corner = |k: u64| {
        let unit = |salt: u64| unit_of(mix(letter ^ (k << 8) ^ salt));
        let column = (unit(1) * LATTICE[0]).floor() / (LATTICE[0] - 1.0);
        let row = (unit(2) * LATTICE[1]).floor() / (LATTICE[1] - 1.0);
        Vec2::new(0.15 + 0.65 * column, 0.25 + 1.1 * row)
    };
    Stroke {
        from: corner(number),
        to: corner(number + 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_that_fill_a_rectangle_stay_within_it() {
        let mut random = Random::new(9);
        let frame = Frame::draw(&mut random, Vec3::ZERO, 0.3);
        let writing = Writing::filling(&mut random, &frame, Vec2::new(1.0, 0.5), 3);
        let mut inked = 0;
        for _ in 0..4000 {
            let point = random.in_box(0.5);
            let at = frame.place(point).abs();
            if writing.coverage(point) > 0.5 {
                assert!(at.x < 1.05 && at.y < 0.55, "{at}");
                inked += 1;
            }
        }
        assert!(inked > 40, "{inked}");
    }

    #[test]
    fn ink_covers_a_part_of_the_label_and_nothing_beyond() {
        let mut random = Random::new(5);
        let writing = Writing {
            weight: 0.08,
            letters: [6, 2],
            ..Writing::draw(&mut random, Vec3::ZERO)
        };
        let mut inked = 0.0;
        for _ in 0..4000 {
            inked += writing.coverage(random.in_box(0.3));
            assert_eq!(writing.coverage(random.direction() * 50.0), 0.0);
        }
        assert!((20.0..3000.0).contains(&inked), "{inked}");
    }
}
