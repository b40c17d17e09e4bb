//! The input of the network of turns, on the device: as [`relight_turn::network_input`] makes it of one turn.

use relight_synth::CURVE_TERMS;
use relight_turn::input_limits::{
    COLOURED, DARK, HARMONICS, LOG_SCALE, MAX_LOG, MAX_RATIO, MAX_VALUE, MIN_MEAN, SMALL, STRONG,
};
use tch::Tensor;

use super::lit::{PlannedTurn, mean_over};
use crate::data::tensors::{columns, upload};
use crate::error::TrainError;

/// Complex numbers as two tensors.
struct Complex {
    re: Tensor,
    im: Tensor,
}

impl Complex {
    /// Both parts after the same change.
    fn each(
        &self,
        change: impl Fn(&Tensor) -> Result<Tensor, tch::TchError>,
    ) -> Result<Self, TrainError> {
        Ok(Self {
            re: change(&self.re)?,
            im: change(&self.im)?,
        })
    }

    fn norm(&self) -> Result<Tensor, TrainError> {
        Ok(self.re.f_square()?.f_add(&self.im.f_square()?)?.f_sqrt()?)
    }

    /// The same direction, no longer than this.
    fn up_to(&self, most: f32) -> Result<Self, TrainError> {
        let factor = self
            .norm()?
            .f_clamp_min(1e-9)?
            .f_reciprocal()?
            .f_mul_scalar(f64::from(most))?
            .f_clamp_max(1.0)?;
        self.each(|part| part.f_mul(&factor))
    }

    /// Real and imaginary part of each channel, one after the other.
    fn interleaved(&self) -> Result<Tensor, TrainError> {
        let mut size = self.re.size();
        size[1] *= 2;
        Ok(Tensor::f_stack(&[&self.re, &self.im], 2)?.f_reshape(size)?)
    }

    /// Turned by an angle.
    fn turned(&self, angle: &Tensor) -> Result<Self, TrainError> {
        let (sin, cos) = (angle.f_sin()?, angle.f_cos()?);
        Ok(Self {
            re: self.re.f_mul(&cos)?.f_sub(&self.im.f_mul(&sin)?)?,
            im: self.re.f_mul(&sin)?.f_add(&self.im.f_mul(&cos)?)?,
        })
    }
}

/// The planes of the network from curves (`batch x terms x 3 x side x side`) of objects (`mask`), 0 outside them.
pub(super) fn network_input(
    curves: &Tensor,
    mask: &Tensor,
    turns: &[PlannedTurn],
) -> Result<Tensor, TrainError> {
    let (means, ratios) = ratios(curves, mask)?;
    let phases = phases(&means, &ratios, mask)?;
    let turned: Vec<Complex> = (0..HARMONICS as i64)
        .map(|m| {
            let harmonic = ratios.each(|part| part.f_select(1, m))?;
            harmonic.turned(&phases.f_mul_scalar(-(m + 1) as f64)?)
        })
        .collect::<Result<_, TrainError>>()?;
    let (mut planes, mut whole) = (Vec::new(), Vec::new());
    let grey = |part: &Tensor| part.f_mean_dim([1_i64].as_slice(), true, None);
    for (m, harmonic) in turned.iter().enumerate() {
        let shown = harmonic.each(|part| {
            if m < COLOURED {
                Ok(part.shallow_clone())
            } else {
                grey(part)
            }
        })?;
        let effective = mean_over(&shown.norm()?.f_square()?, mask)?
            .f_sqrt()?
            .f_add_scalar(f64::from(SMALL))?;
        whole.push(
            effective
                .f_log()?
                .f_div_scalar(f64::from(LOG_SCALE))?
                .f_add_scalar(1.0)?,
        );
        let value = shown.each(|part| part.f_div(&effective))?;
        planes.push(value.up_to(MAX_VALUE)?.interleaved()?);
    }
    for harmonic in &turned[..STRONG] {
        planes.push(harmonic.each(grey)?.interleaved()?);
        whole.push(
            Complex {
                re: mean_over(&harmonic.re, mask)?,
                im: mean_over(&harmonic.im, mask)?,
            }
            .interleaved()?,
        );
    }
    let logarithms = means.f_log()?;
    let logarithms = logarithms.f_sub(&mean_over(&logarithms, mask)?)?;
    let most = f64::from(MAX_LOG);
    planes.push(logarithms.f_clamp(-most, most)?);
    planes.push(places(mask)?);
    let elevations: Vec<f32> = turns
        .iter()
        .map(|one| 3.0 * one.plan.elevation.sin() - 1.0)
        .collect();
    whole.insert(0, columns(&elevations, turns.len(), mask)?);
    let whole = Tensor::f_cat(&whole, 1)?;
    let mut size = mask.size();
    size[1] = whole.size()[1];
    planes.push(whole.f_expand(size, false)?);
    Ok(Tensor::f_cat(&planes, 1)?.f_mul(mask)?)
}

/// Means of curves in means over the object (`batch x 3 x side x side`), and harmonics over means (`batch x harmonics x 3 x side
/// x side`).
fn ratios(curves: &Tensor, mask: &Tensor) -> Result<(Tensor, Complex), TrainError> {
    let means = curves.f_select(1, 0)?;
    let of_all = mean_over(&means.f_clamp_min(0.0)?, mask)?.f_clamp_min(1e-9)?;
    let means = means.f_div(&of_all)?.f_clamp_min(f64::from(MIN_MEAN))?;
    let over = means.f_mul(&of_all)?.f_unsqueeze(1)?;
    let part = |first: i64| -> Result<Tensor, tch::TchError> {
        let end = CURVE_TERMS as i64;
        curves.f_slice(1, first, end, 2)?.f_div(&over)
    };
    let ratios = Complex {
        re: part(1)?,
        im: part(2)?,
    };
    Ok((means, ratios.up_to(MAX_RATIO)?))
}

/// The phase of each turn's first harmonic, radians, `batch x 1 x 1 x 1`.
fn phases(means: &Tensor, ratios: &Complex, mask: &Tensor) -> Result<Tensor, TrainError> {
    let weight = means
        .f_div(&means.f_add_scalar(f64::from(DARK))?)?
        .f_mul(mask)?;
    let sum = |part: &Tensor| {
        let all = [1_i64, 2, 3];
        part.f_select(1, 0)?
            .f_mul(&weight)?
            .f_sum_dim_intlist(all.as_slice(), true, None)
    };
    Ok(sum(&ratios.im)?.f_atan2(&sum(&ratios.re)?)?)
}

/// 1, the place from the left and from the bottom, -1..1.
fn places(mask: &Tensor) -> Result<Tensor, TrainError> {
    let side = mask.size()[3];
    let steps: Vec<f32> = (0..side)
        .map(|at| 2.0 * at as f32 / side as f32 - 1.0)
        .collect();
    let across = upload(&steps, &[1, 1, 1, side], mask)?.f_expand_as(mask)?;
    let down = upload(&steps, &[1, 1, side, 1], mask)?.f_neg()?;
    Ok(Tensor::f_cat(
        &[mask.shallow_clone(), across, down.f_expand_as(mask)?],
        1,
    )?)
}
