//! What the curves of brightness over a turn say about a part of the image: is it the object or what is behind it?
//!
//! The light turns about the object, so the brightness of each of its pixels follows the first harmonics of the
//! table's angle: a diffuse surface's irradiance has few others (Ramamoorthi and Hanrahan, "An efficient
//! representation for irradiance environment maps", 2001). Logarithms make paint of any colour alike. A pixel of
//! the background shows another thing at every angle, and its curve has all harmonics. This looks at no mask but
//! the one that is asked about, and so is evidence of its own.

use crate::bitmap::Bitmap;
use crate::cut::grab_cut::squared_distance;

/// Harmonics of the table's angle that a diffuse surface follows.
const ORDER: usize = 2;
/// Their cosines and sines.
const WAVES: usize = 2 * ORDER;
/// With fewer frames a curve has no residual.
const MIN_FRAMES: usize = 2 * (WAVES + 1);
/// Added to a luminance, 0..=1, before its logarithm: noise counts little below.
const DARK: f32 = 0.01;
/// Residual variance by noise.
const NOISE: f32 = 1e-4;
/// What moves has at least so many times the residual variance of what does not, where the curves say anything.
const CLEAR: f32 = 4.0;
/// A curve of a smaller change, as a logarithm, stands still.
const STILL: f32 = 0.05;
/// Two curves go together from this correlation on.
const TOGETHER: f32 = 0.7;

/// The curves of all pixels.
#[derive(Debug)]
pub(crate) struct TemporalEvidence {
    /// Variance that the harmonics do not explain, for each pixel; empty with few frames.
    residual: Vec<f32>,
    /// Cosines and sines of the harmonics.
    waves: Vec<[f32; WAVES]>,
}

/// Sums over the frames.
#[derive(Debug)]
pub(crate) struct Curves {
    frames: usize,
    sum: Vec<[f32; WAVES + 2]>,
}

impl Curves {
    /// Of `frames` frames, spread evenly over the turn, of `pixels` pixels.
    pub(crate) fn new(frames: usize, pixels: usize) -> Self {
        let pixels = if frames < MIN_FRAMES { 0 } else { pixels };
        Self {
            frames,
            sum: vec![[0.0; WAVES + 2]; pixels],
        }
    }

    /// Adds frame number `at`.
    pub(crate) fn add(&mut self, at: usize, lab: &[[f32; 3]]) {
        let angle = std::f32::consts::TAU * at as f32 / self.frames.max(1) as f32;
        let basis: [f32; WAVES] = std::array::from_fn(|wave| {
            let angle = angle * (wave / 2 + 1) as f32;
            if wave % 2 == 0 {
                angle.cos()
            } else {
                angle.sin()
            }
        });
        for (sum, &[light, ..]) in self.sum.iter_mut().zip(lab) {
            let log = (luminance(light) + DARK).ln();
            sum[0] += log;
            sum[1] += log * log;
            for (to, wave) in sum[2..].iter_mut().zip(basis) {
                *to += wave * log;
            }
        }
    }

    /// What they say together.
    pub(crate) fn finish(self) -> TemporalEvidence {
        let many = self.frames.max(1) as f32;
        let free = self.frames.saturating_sub(WAVES + 1).max(1) as f32;
        let wave = |sum: &[f32; WAVES + 2]| std::array::from_fn(|at| 2.0 * sum[at + 2] / many);
        let waves: Vec<[f32; WAVES]> = self.sum.iter().map(wave).collect();
        let residual = self.sum.iter().zip(&waves).map(|(sum, waves)| {
            let explained: f32 = waves.iter().map(|wave| wave * wave / 2.0).sum();
            let all = sum[1] - sum[0] * sum[0] / many;
            ((all - many * explained) / free).max(0.0) + NOISE
        });
        TemporalEvidence {
            residual: residual.collect(),
            waves,
        }
    }
}

impl TemporalEvidence {
    /// Whether the brightness of the pixels of `part` changes as what is behind the object does, and not as the object
    /// next to it; `None` if the curves say nothing.
    pub(crate) fn moves(&self, part: &Bitmap, beside: &Bitmap, ground: &Bitmap) -> Option<bool> {
        self.towards_ground(part, beside, ground)
            .map(|towards| towards > 0.5)
    }

    /// Where the changes of `part` lie, between those of the object next to it (0) and those of what is behind it (1);
    /// `None` if the curves say nothing.
    pub(crate) fn towards_ground(
        &self,
        part: &Bitmap,
        beside: &Bitmap,
        ground: &Bitmap,
    ) -> Option<f32> {
        let of_part = self.residual_of(part)?;
        let of_object = self.residual_of(beside)?;
        let of_ground = self.residual_of(ground)?;
        let says = of_ground > CLEAR * of_object;
        says.then(|| (of_part / of_object).ln() / (of_ground / of_object).ln())
    }

    /// Whether two parts become brighter and darker together over the turn.
    pub(crate) fn together(&self, one: &Bitmap, other: &Bitmap) -> bool {
        let (Some(one), Some(other)) = (self.course(one), self.course(other)) else {
            return false;
        };
        let dot = |a: &[f32; WAVES], b: &[f32; WAVES]| -> f32 {
            a.iter().zip(b).map(|(a, b)| a * b).sum()
        };
        let lengths = (dot(&one, &one) * dot(&other, &other)).sqrt();
        let still = dot(&one, &one).max(dot(&other, &other)) < STILL * STILL;
        still || lengths > 0.0 && dot(&one, &other) > TOGETHER * lengths
    }

    /// Whether the curve of a part is nearer to that of one other than to that of another; `None` if one of them is
    /// empty, or the frames are few.
    pub(crate) fn nearer(&self, part: &Bitmap, one: &Bitmap, another: &Bitmap) -> Option<bool> {
        let (part, one, another) = (self.course(part)?, self.course(one)?, self.course(another)?);
        Some(squared_distance(&part, &one) < squared_distance(&part, &another))
    }

    /// The median residual of a part.
    pub(crate) fn residual_of(&self, part: &Bitmap) -> Option<f32> {
        let pairs = part.bits().iter().zip(&self.residual);
        let mut values: Vec<f32> = pairs
            .filter(|(bit, _)| **bit)
            .map(|(_, value)| *value)
            .collect();
        let middle = values.len() / 2;
        if values.is_empty() {
            return None;
        }
        Some(*values.select_nth_unstable_by(middle, f32::total_cmp).1)
    }

    /// The mean harmonics of a part.
    fn course(&self, part: &Bitmap) -> Option<[f32; WAVES]> {
        let mut sum = [0.0; WAVES];
        let mut count = 0.0;
        for (_, waves) in part.bits().iter().zip(&self.waves).filter(|(bit, _)| **bit) {
            sum.iter_mut()
                .zip(waves)
                .for_each(|(sum, wave)| *sum += wave);
            count += 1.0;
        }
        (count > 0.0).then(|| sum.map(|sum| sum / count))
    }
}

/// The luminance, 0..=1, of a lightness L.
pub(crate) fn luminance(light: f32) -> f32 {
    if light > 8.0 {
        ((light + 16.0) / 116.0).powi(3)
    } else {
        light * 27.0 / 24389.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of three parts: a bright one and a dark one that one light turns about, and one that shows other
    /// things all the time.
    fn evidence(frames: usize) -> TemporalEvidence {
        let mut curves = Curves::new(frames, 30);
        for at in 0..frames {
            let angle = std::f32::consts::TAU * at as f32 / frames as f32;
            let light = 1.0 + 0.6 * angle.cos() + 0.2 * (2.0 * angle).sin();
            let other = [12.0, 55.0, 30.0, 80.0, 20.0, 41.0, 66.0][(at * 5 + at / 3) % 7];
            let levels = [60.0 * light.cbrt(), 20.0 * light.cbrt(), other];
            let lab: Vec<[f32; 3]> = (0..30).map(|x| [levels[x / 10], 0.0, 0.0]).collect();
            curves.add(at, &lab);
        }
        curves.finish()
    }

    fn third(which: usize) -> Bitmap {
        Bitmap::new((30, 1), (0..30).map(|x| x / 10 == which))
    }

    #[test]
    fn what_is_behind_the_object_moves_and_a_darker_part_of_it_does_not() {
        let evidence = evidence(32);
        assert_eq!(evidence.moves(&third(1), &third(0), &third(2)), Some(false));
        assert_eq!(evidence.moves(&third(2), &third(0), &third(2)), Some(true));
        let towards = evidence.towards_ground(&third(1), &third(0), &third(2));
        assert!(towards.is_some_and(|towards| towards < 0.2), "{towards:?}");
        assert!(evidence.together(&third(0), &third(1)));
        assert!(!evidence.together(&third(0), &third(2)));
        assert_eq!(evidence.nearer(&third(1), &third(0), &third(2)), Some(true));
    }

    #[test]
    fn few_frames_and_parts_alike_say_nothing() {
        assert_eq!(evidence(6).moves(&third(1), &third(0), &third(2)), None);
        assert_eq!(evidence(32).moves(&third(1), &third(0), &third(1)), None);
    }
}
