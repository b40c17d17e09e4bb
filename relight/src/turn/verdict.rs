//! Whether the room's light is fit for this.

use rayon::prelude::*;
use relit_data::turn_light::LEAST_MODULATION;
use serde::Serialize;

use super::TurnCurves;
use super::light::MATT_WAVES;
use super::solve::median;
use crate::light::NormalEquations;

/// Above this part beyond the second harmonic, the modulation is not that of a matt surface.
const MOST_BEYOND: f64 = 0.3;

/// How much the light of the turn tells.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Conditioning {
    /// The median over the pixels of the effective value of the first and second harmonic, over the mean.
    pub modulation: f64,
    /// The median over the pixels of the part of a curve's variation that lies beyond the second harmonic.
    pub beyond: f64,
    /// What follows.
    pub verdict: RoomVerdict,
}

/// Whether normals and albedo are to be expected from the turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RoomVerdict {
    /// The light has a bright side.
    Good,
    /// The light is nearly the same from everywhere.
    TooEven,
    /// Most of what varies is shadows or highlights.
    NotMatt,
}

impl RoomVerdict {
    /// What to do about it, in one sentence; none where all is well.
    #[must_use]
    pub const fn advice(self) -> Option<&'static str> {
        match self {
            Self::Good => None,
            Self::TooEven => Some(
                "the room is too even for normals and albedo: turn on one lamp at the side, and capture the turn again",
            ),
            Self::NotMatt => Some(
                "most of what varies over the turn is shadows or highlights, which the normals do not explain: \
                 do not trust them where the confidence is low",
            ),
        }
    }
}

impl Conditioning {
    /// That of a turn.
    #[must_use]
    pub fn of(curves: &TurnCurves) -> Self {
        let pixels: Vec<[f64; 2]> = (0..curves.pixels())
            .into_par_iter()
            .filter_map(|pixel| of_pixel(curves, pixel))
            .collect();
        let modulation = median(pixels.iter().map(|of| of[0]));
        let beyond = median(pixels.iter().map(|of| of[1]));
        let verdict = if modulation < LEAST_MODULATION {
            RoomVerdict::TooEven
        } else if beyond > MOST_BEYOND {
            RoomVerdict::NotMatt
        } else {
            RoomVerdict::Good
        };
        Self {
            modulation,
            beyond,
            verdict,
        }
    }
}

/// Modulation and part beyond the second harmonic of a pixel's light, all channels together; none where it is
/// dark or mostly clipped.
fn of_pixel(curves: &TurnCurves, pixel: usize) -> Option<[f64; 2]> {
    let mut equations = NormalEquations::new(MATT_WAVES);
    let mut seen = Vec::new();
    let parts = curves.values(pixel).iter().zip(curves.weights(pixel));
    for ((value, weight), waves) in parts.zip(curves.waves()) {
        if weight.iter().all(|&weight| weight > 0.5) {
            let grey = value.iter().map(|&v| f64::from(v)).sum::<f64>();
            equations.add(&waves[..MATT_WAVES], [grey, 0.0, 0.0]);
            seen.push((grey, waves));
        }
    }
    if 2 * seen.len() < curves.parts() {
        return None;
    }
    let solution = equations.solve()?.into_iter().map(|[value, ..]| value);
    let solution: Vec<f64> = solution.collect();
    let mean = seen.iter().map(|(grey, _)| grey).sum::<f64>() / seen.len() as f64;
    let (mut all, mut rest) = (0.0, 0.0);
    for (grey, waves) in seen {
        let model: f64 = waves.iter().zip(&solution).map(|(a, b)| a * b).sum();
        all += (grey - mean).powi(2);
        rest += (grey - model).powi(2);
    }
    let harmonics: f64 = solution[1..].iter().map(|value| value * value).sum();
    let constant = solution[0];
    (constant > 1e-5 && all > 0.0).then(|| [(harmonics / 2.0).sqrt() / constant, rest / all])
}
