//! The input of the network of turns, on the device: as [`relight_turn::network_input`] makes it of one turn.

use relight_synth::CURVE_TERMS;
use relight_turn::input_limits::{
    COLOURED, DARK, HARMONICS, LOG_SCALE, MAX_LOG, MAX_RATIO, MAX_VALUE, MIN_MEAN, SMALL, STRONG,
};
use tch::Tensor;

use super::lit::{PlannedTurn, mean_over};
use crate::engine::tensors::{columns, grey, upload};

/// Complex numbers as two tensors.
struct Complex {
    re: Tensor,
    im: Tensor,
}

impl Complex {
    /// Both parts after the same change.
    fn each(&self, change: impl Fn(&Tensor) -> Tensor) -> Self {
        Self {
            re: change(&self.re),
            im: change(&self.im),
        }
    }

    fn norm(&self) -> Tensor {
        (self.re.square() + self.im.square()).sqrt()
    }

    /// The same direction, no longer than this.
    fn up_to(&self, most: f32) -> Self {
        let factor = (self.norm().clamp_min(1e-9).reciprocal() * f64::from(most)).clamp_max(1.0);
        self.each(|part| part * &factor)
    }

    /// Real and imaginary part of each channel, one after the other.
    fn interleaved(&self) -> Tensor {
        let mut size = self.re.size();
        size[1] *= 2;
        Tensor::stack(&[&self.re, &self.im], 2).reshape(size)
    }

    /// Turned by an angle.
    fn turned(&self, angle: &Tensor) -> Self {
        let (sin, cos) = (angle.sin(), angle.cos());
        Self {
            re: &self.re * &cos - &self.im * &sin,
            im: &self.re * &sin + &self.im * &cos,
        }
    }
}

/// The planes of the network from curves (`batch x terms x 3 x side x side`) of objects (`mask`), 0 outside them.
pub(super) fn network_input(curves: &Tensor, mask: &Tensor, turns: &[PlannedTurn]) -> Tensor {
    let (means, ratios) = ratios(curves, mask);
    let phases = phases(&means, &ratios, mask);
    let turned: Vec<Complex> = (0..HARMONICS as i64)
        .map(|m| {
            let harmonic = ratios.each(|part| part.select(1, m));
            harmonic.turned(&(&phases * (-(m + 1) as f64)))
        })
        .collect();
    let (mut planes, mut whole) = (Vec::new(), Vec::new());
    for (m, harmonic) in turned.iter().enumerate() {
        let shown = harmonic.each(|part| {
            if m < COLOURED {
                part.shallow_clone()
            } else {
                grey(part)
            }
        });
        let effective = mean_over(&shown.norm().square(), mask).sqrt() + f64::from(SMALL);
        whole.push(effective.log() / f64::from(LOG_SCALE) + 1.0);
        let value = shown.each(|part| part / &effective);
        planes.push(value.up_to(MAX_VALUE).interleaved());
    }
    for harmonic in &turned[..STRONG] {
        planes.push(harmonic.each(grey).interleaved());
        whole.push(
            Complex {
                re: mean_over(&harmonic.re, mask),
                im: mean_over(&harmonic.im, mask),
            }
            .interleaved(),
        );
    }
    let logarithms = means.log();
    let logarithms = &logarithms - mean_over(&logarithms, mask);
    let most = f64::from(MAX_LOG);
    planes.push(logarithms.clamp(-most, most));
    planes.push(places(mask));
    let elevations: Vec<f32> = turns
        .iter()
        .map(|one| 3.0 * one.plan.elevation.sin() - 1.0)
        .collect();
    whole.insert(0, columns(&elevations, turns.len(), mask));
    let whole = Tensor::cat(&whole, 1);
    let mut size = mask.size();
    size[1] = whole.size()[1];
    planes.push(whole.expand(size, false));
    Tensor::cat(&planes, 1) * mask
}

/// Means of curves in means over the object (`batch x 3 x side x side`), and harmonics over means (`batch x harmonics x 3 x side
/// x side`).
fn ratios(curves: &Tensor, mask: &Tensor) -> (Tensor, Complex) {
    let means = curves.select(1, 0);
    let of_all = mean_over(&means.clamp_min(0.0), mask).clamp_min(1e-9);
    let means = (&means / &of_all).clamp_min(f64::from(MIN_MEAN));
    let over = (&means * &of_all).unsqueeze(1);
    let part = |first: i64| {
        let end = CURVE_TERMS as i64;
        curves.slice(1, first, end, 2) / &over
    };
    let ratios = Complex {
        re: part(1),
        im: part(2),
    };
    (means, ratios.up_to(MAX_RATIO))
}

/// The phase of each turn's first harmonic, radians, `batch x 1 x 1 x 1`.
fn phases(means: &Tensor, ratios: &Complex, mask: &Tensor) -> Tensor {
    let weight = means / (means + f64::from(DARK)) * mask;
    let sum = |part: &Tensor| {
        let all = [1_i64, 2, 3];
        (part.select(1, 0) * &weight).sum_dim_intlist(all.as_slice(), true, None)
    };
    sum(&ratios.im).atan2(&sum(&ratios.re))
}

/// 1, the place from the left and from the bottom, -1..1.
fn places(mask: &Tensor) -> Tensor {
    let side = mask.size()[3];
    let steps: Vec<f32> = (0..side)
        .map(|at| 2.0 * at as f32 / side as f32 - 1.0)
        .collect();
    let across = upload(&steps, &[1, 1, 1, side], mask).expand_as(mask);
    let down = -upload(&steps, &[1, 1, side, 1], mask);
    Tensor::cat(&[mask.shallow_clone(), across, down.expand_as(mask)], 1)
}
