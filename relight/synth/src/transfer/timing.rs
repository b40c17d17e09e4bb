//! The table's angle as a rig knows it: a little off at each frame, and with frames missing.

use std::array::from_fn;
use std::f64::consts::TAU;

use relight_core::light::NormalEquations;

use super::turn_plan::CURVE_TERMS;
#[cfg(test)]
use super::turn_plan::CurveTerms;
use crate::random::Random;

/// Angles of a turn that are looked at.
const FRAMES: usize = 120;
/// Deviation of the turn from 360 degrees, in parts of it.
const LENGTH_ERROR: f32 = 0.005;
/// Deviation of the amplitude by which the table runs ahead and behind, once and twice a turn, degrees.
const RIPPLE_DEG: f32 = 0.8;
/// Range of the deviation of each angle for itself, degrees.
const JITTER_DEG: std::ops::Range<f32> = 0.05..1.0;
/// Most gaps of a turn, and most angles in each.
const GAPS: usize = 3;
const MAX_GAP: usize = 6;
/// Ridge on the coefficients, as a part of the mean of the diagonal. Numerical.
const RIDGE: f64 = 1e-6;

/// A curve with errors of its angles: its coefficients by least squares over the existing frames.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct TableTiming {
    /// Row by row: what each true coefficient adds to each that is found.
    pub(super) matrix: [[f32; CURVE_TERMS]; CURVE_TERMS],
}

/// A frame: the stated and the true angle of the table, radians.
#[derive(Debug, Clone, Copy)]
struct FrameAngle {
    said: f64,
    is: f64,
}

impl TableTiming {
    /// A turn's timing; `None` if its equations have no solution.
    pub(super) fn draw(random: &mut Random) -> Option<Self> {
        let angles = frame_angles(random);
        Self::from_angles(&angles)
    }

    fn from_angles(angles: &[FrameAngle]) -> Option<Self> {
        let mut matrix = [[0.0; CURVE_TERMS]; CURVE_TERMS];
        // The equations take three columns at once.
        for first in (0..CURVE_TERMS).step_by(3) {
            let mut equations = NormalEquations::new(CURVE_TERMS);
            for angle in angles {
                let shown = terms(angle.is);
                let values = from_fn(|k| shown.get(first + k).copied().unwrap_or(0.0));
                equations.add(&terms(angle.said), values);
            }
            equations.add_ridge(0, RIDGE);
            for (row, found) in matrix.iter_mut().zip(equations.solve()?) {
                for (cell, value) in row[first..].iter_mut().zip(found) {
                    *cell = value as f32;
                }
            }
        }
        Some(Self { matrix })
    }
}

/// `1, cos a, -sin a, cos 2a, -sin 2a` and so on.
fn terms(angle: f64) -> [f64; CURVE_TERMS] {
    let mut terms = [1.0; CURVE_TERMS];
    for m in 1..=CURVE_TERMS / 2 {
        let (sin, cos) = (m as f64 * angle).sin_cos();
        terms[2 * m - 1] = cos;
        terms[2 * m] = -sin;
    }
    terms
}

fn frame_angles(random: &mut Random) -> Vec<FrameAngle> {
    let length = f64::from(1.0 + LENGTH_ERROR * random.normal());
    let ripples: [(f64, f64); 2] = from_fn(|_| {
        let amplitude = (RIPPLE_DEG * random.normal()).to_radians();
        (
            f64::from(amplitude),
            f64::from(random.uniform(0.0..1.0)) * TAU,
        )
    });
    let jitter = random.log_uniform(JITTER_DEG).to_radians();
    let mut is_there = [true; FRAMES];
    for _ in 0..random.count(0..GAPS + 1) {
        let first = random.index(FRAMES);
        let gap = random.count(1..MAX_GAP + 1);
        (first..first + gap).for_each(|at| is_there[at % FRAMES] = false);
    }
    (0..FRAMES)
        .map(|at| {
            let said = at as f64 / FRAMES as f64 * TAU;
            let ripple = |(m, (amplitude, phase)): (usize, &(f64, f64))| {
                amplitude * ((m + 1) as f64 * said + phase).sin()
            };
            let ahead: f64 = ripples.iter().enumerate().map(ripple).sum();
            let own = f64::from(jitter * random.normal());
            FrameAngle {
                said,
                is: said * length + ahead + own,
            }
        })
        .zip(is_there)
        .filter_map(|(angle, is_there)| is_there.then_some(angle))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    impl TableTiming {
        /// The coefficients as they are found.
        fn seen(&self, curve: &CurveTerms) -> CurveTerms {
            self.matrix.map(|row| {
                let mut sum = [0.0; 3];
                for (part, values) in row.iter().zip(curve) {
                    for (sum, value) in sum.iter_mut().zip(values) {
                        *sum += part * value;
                    }
                }
                sum
            })
        }
    }

    fn curve() -> CurveTerms {
        from_fn(|k| from_fn(|c| 1.0 / (1 + k + c) as f32))
    }

    fn largest_difference(a: &CurveTerms, b: &CurveTerms) -> f32 {
        let pairs = a.as_flattened().iter().zip(b.as_flattened());
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    }

    #[test]
    fn frames_that_are_missing_change_nothing_where_the_angles_are_right() {
        let angles: Vec<FrameAngle> = (0..FRAMES)
            .filter(|at| !(10..16).contains(at) && at % 7 != 0)
            .map(|at| at as f64 / FRAMES as f64 * TAU)
            .map(|angle| FrameAngle {
                said: angle,
                is: angle,
            })
            .collect();
        let seen = TableTiming::from_angles(&angles).unwrap().seen(&curve());
        assert!(largest_difference(&seen, &curve()) < 1e-3);
    }

    #[test]
    fn an_angle_that_is_always_off_by_the_same_turns_each_harmonic() {
        let off = 0.1_f64;
        let angles: Vec<FrameAngle> = (0..FRAMES)
            .map(|at| at as f64 / FRAMES as f64 * TAU)
            .map(|said| FrameAngle {
                said,
                is: said + off,
            })
            .collect();
        let before = curve();
        let seen = TableTiming::from_angles(&angles).unwrap().seen(&before);
        let mut expected = before;
        for m in 1..=CURVE_TERMS / 2 {
            let (sin, cos) = (m as f32 * off as f32).sin_cos();
            for c in 0..3 {
                let (re, im) = (before[2 * m - 1][c], before[2 * m][c]);
                expected[2 * m - 1][c] = re * cos - im * sin;
                expected[2 * m][c] = re * sin + im * cos;
            }
        }
        assert!(largest_difference(&seen, &expected) < 1e-4);
    }

    #[test]
    fn drawn_timings_change_a_curve_a_little() {
        let mut random = Random::new(5);
        for _ in 0..50 {
            let seen = TableTiming::draw(&mut random).unwrap().seen(&curve());
            let change = largest_difference(&seen, &curve());
            assert!(change > 1e-5 && change < 0.5, "{change}");
        }
    }
}
