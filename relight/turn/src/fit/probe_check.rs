//! Checks the place given for a ball: the light that is fitted to it has to fit it, and no other circle
//! has a clearly smaller residual. Knows nothing of what the light is used for.

use crate::error::TurnError;
use crate::fit::curve_statistics::{CurveStatistics, all_statistics};
use crate::fit::environment::relative_residual;
use crate::model::frame::TableFrame;
use crate::observe::curves::TurnCurves;
use crate::observe::mirror_panorama::MirrorPanorama;
use crate::observe::probe::{ACROSS, ProbeBall, middle_of};
use crate::observe::probe_place::ProbePlace;

/// Share of a circle's radius that counts, 0 to 1. By hand: the rim also shows what is behind it.
const RADIUS_SHARE: f64 = 0.92;
/// Middles that are tried first, in either direction, in given radii. By hand.
const SHIFTS: [f64; 5] = [-0.5, -0.25, 0.0, 0.25, 0.5];
/// Radii that are tried first, in given radii. By hand: steps of a fourth root of 2.
const SCALES: [f64; 5] = [0.7, 0.84, 1.0, 1.19, 1.42];
/// Steps around the best, in parts of half their distances. Derived: either way and none.
const STEPS: [f64; 3] = [-1.0, 0.0, 1.0];
/// How often the best is improved, each time by half the steps. By hand.
const REFINED: i32 = 3;
/// Largest residual of a grey ball by its own light, over that by an even light. By hand.
const MAX_OF_GREY: f64 = 0.3;
/// The same of a chrome ball; the panorama resolves its small windows less. By hand.
const MAX_OF_CHROME: f64 = 0.6;
/// Largest part of the given circle's residual with which another one is the ball. By hand.
const CLEARLY: f64 = 0.6;
/// By how much its residual has to be less. By hand.
const LESS: f64 = 0.02;
/// Least distance to the given circle, in radii. By hand: nearer ones measure nearly the same light.
const APART: f64 = 0.08;
/// Least share of a circle, 0 to 1, that has to be in the picture. By hand.
const MIN_INSIDE: f64 = 0.9;

/// A circle, in radii from the middle that was given: to the right and up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Circle {
    middle: [f64; 2],
    radius: f64,
}

/// The pixels at and around a ball, each as a curve, and where they are.
struct Shown<'a> {
    curves: &'a TurnCurves,
    statistics: Vec<CurveStatistics>,
    at: Vec<[f64; 2]>,
    frame: TableFrame,
    ball: ProbeBall,
}

/// The residual of a ball's own light, over the variation, 0 to 1, at its given place.
///
/// # Errors
/// [`TurnError::NoBall`] if that is most of it, [`TurnError::Misplaced`] if another circle has a clearly
/// smaller one.
pub(crate) fn check(
    curves: &TurnCurves,
    frame: TableFrame,
    place: ProbePlace,
    ball: ProbeBall,
) -> Result<f64, TurnError> {
    let shown = Shown {
        statistics: all_statistics(curves),
        at: curves.places().iter().map(|&at| middle_of(at)).collect(),
        curves,
        frame,
        ball,
    };
    let given = Circle::GIVEN;
    let residual = shown.residual(given).unwrap_or(1.0);
    let (best, least) = shown.best(given, residual);
    let [x, y] = best.middle;
    let apart = x.hypot(y).max((best.radius - 1.0).abs());
    let most = max_residual(ball);
    if least < CLEARLY * residual && least < residual - LESS && apart > APART && least < most {
        let [x, y] = place.in_picture(best.middle);
        return Err(TurnError::Misplaced {
            given: place.to_string(),
            better: [x, y, best.radius * place.radius].map(f64::round),
            explained: [residual, least].map(|residual| 100.0 * (1.0 - residual).max(0.0)),
        });
    }
    if residual > most {
        return Err(TurnError::NoBall {
            given: place.to_string(),
            explained: 100.0 * (1.0 - residual).max(0.0),
        });
    }
    Ok(residual)
}

/// The largest residual of a ball by its own light.
pub(crate) const fn max_residual(ball: ProbeBall) -> f64 {
    match ball {
        ProbeBall::Grey => MAX_OF_GREY,
        ProbeBall::Chrome => MAX_OF_CHROME,
    }
}

impl Shown<'_> {
    /// The circle of the smallest residual, and that residual.
    fn best(&self, given: Circle, residual: f64) -> (Circle, f64) {
        let mut best = (given, residual);
        let tries = SHIFTS.iter().flat_map(|&x| {
            SHIFTS.iter().flat_map(move |&y| {
                SCALES.iter().map(move |&radius| Circle {
                    middle: [x, y],
                    radius,
                })
            })
        });
        self.try_all(tries, &mut best);
        for round in 1..=REFINED {
            let part = 0.5_f64.powi(round);
            let around = best.0;
            let tries = STEPS.iter().flat_map(|x| {
                STEPS.iter().flat_map(move |y| {
                    STEPS.iter().map(move |scale| Circle {
                        middle: [
                            around.middle[0] + 0.25 * part * x,
                            around.middle[1] + 0.25 * part * y,
                        ],
                        radius: around.radius * SCALES[3].powf(part * scale),
                    })
                })
            });
            self.try_all(tries, &mut best);
        }
        best
    }

    fn try_all(&self, circles: impl Iterator<Item = Circle>, best: &mut (Circle, f64)) {
        for circle in circles {
            if let Some(residual) = self.residual(circle)
                && residual < best.1
            {
                *best = (circle, residual);
            }
        }
    }

    /// The residual of the light fitted to a ball in a circle, over that of an even light; `None` if the circle is not
    /// in the picture, or nothing varies in it.
    fn residual(&self, circle: Circle) -> Option<f64> {
        let wanted =
            std::f64::consts::PI * (RADIUS_SHARE * circle.radius * ACROSS as f64 / 2.0).powi(2);
        let (pixels, normals): (Vec<usize>, Vec<[f64; 3]>) = self
            .at
            .iter()
            .enumerate()
            .filter_map(|(pixel, &at)| Some((pixel, circle.normal(at)?)))
            .unzip();
        if (pixels.len() as f64) < MIN_INSIDE * wanted {
            return None;
        }
        match self.ball {
            ProbeBall::Grey => {
                let statistics: Vec<&CurveStatistics> = pixels
                    .iter()
                    .map(|&pixel| &self.statistics[pixel])
                    .collect();
                relative_residual(&statistics, &normals, &self.frame)
            }
            ProbeBall::Chrome => self.residual_by_mirror(&pixels, &normals),
        }
    }

    /// The same for a ball that mirrors its surroundings.
    fn residual_by_mirror(&self, pixels: &[usize], normals: &[[f64; 3]]) -> Option<f64> {
        let mut panorama = MirrorPanorama::new(self.frame);
        self.each_value(pixels, normals, |normal, angle, value| {
            panorama.add(angle, normal, value);
        });
        let all = panorama.all()?;
        let (mut rest, mut energy) = (0.0, 0.0);
        self.each_value(pixels, normals, |normal, angle, value| {
            let seen = panorama.seen(angle, normal).unwrap_or(all);
            for c in 0..3 {
                rest += (value[c] - seen[c]).powi(2);
                energy += (value[c] - all[c]).powi(2);
            }
        });
        (energy > 0.0).then(|| rest / energy)
    }

    /// Every value that is not clipped, with its normal and the table's angle, radians.
    fn each_value(
        &self,
        pixels: &[usize],
        normals: &[[f64; 3]],
        mut take: impl FnMut([f64; 3], f64, [f64; 3]),
    ) {
        for (&pixel, &normal) in pixels.iter().zip(normals) {
            let values = self.curves.values(pixel).iter();
            let parts = values.zip(self.curves.weights(pixel));
            for ((value, weight), &angle) in parts.zip(self.curves.angles()) {
                if weight.iter().all(|&weight| weight > 0.5) {
                    take(normal, angle, value.map(f64::from));
                }
            }
        }
    }
}

impl Circle {
    /// The one that was given.
    pub(crate) const GIVEN: Self = Self {
        middle: [0.0; 2],
        radius: 1.0,
    };

    /// The normal of the ball in it at a place, where that is well inside.
    pub(crate) fn normal(self, at: [f64; 2]) -> Option<[f64; 3]> {
        let [x, y] = [0, 1].map(|i| (at[i] - self.middle[i]) / self.radius);
        let square = x * x + y * y;
        (square < RADIUS_SHARE * RADIUS_SHARE).then(|| [x, y, (1.0 - square).sqrt()])
    }
}
