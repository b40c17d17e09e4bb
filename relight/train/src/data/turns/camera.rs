//! What a rig makes of curves, on the device: highlights that clip, errors of the table's angle, noise, and the mirror image.

use std::f64::consts::TAU;

use relight_synth::CURVE_TERMS;
use tch::Tensor;

use super::lit::{LitTurns, PlannedTurn, mean_over};
use crate::data::tensors::{columns, indices, upload};
use crate::error::TrainError;

/// Values of a curve at which clipping is looked at.
const ANGLES: usize = 36;

/// Turns as they are filmed; `noise` has a standard deviation of 1, `batch x (terms - 1) 3 x side x side`.
pub(super) fn filmed(
    lit: LitTurns,
    turns: &[PlannedTurn],
    noise: &Tensor,
) -> Result<LitTurns, TrainError> {
    let curves = clipped(&lit.curves, &lit.mask, turns)?;
    let curves = mistimed(&curves, turns)?;
    let curves = noisy(&curves, &lit.mask, turns, noise)?;
    mirrored(LitTurns { curves, ..lit }, turns)
}

/// The numbers of those turns of a batch that ask for something; none if there are none.
fn chosen(
    turns: &[PlannedTurn],
    is_asked: impl Fn(&PlannedTurn) -> bool,
    like: &Tensor,
) -> Result<Option<(Vec<usize>, Tensor)>, TrainError> {
    let numbers: Vec<usize> = (0..turns.len())
        .filter(|&at| is_asked(&turns[at]))
        .collect();
    if numbers.is_empty() {
        return Ok(None);
    }
    let at = indices(numbers.iter().copied(), like.device())?;
    Ok(Some((numbers, at)))
}

/// `values x terms`: `1, cos a, -sin a, cos 2a, -sin 2a` and so on at angles around the turn.
fn terms_at_angles(like: &Tensor) -> Result<Tensor, TrainError> {
    let values: Vec<f32> = (0..ANGLES)
        .flat_map(|at| {
            let angle = TAU * at as f64 / ANGLES as f64;
            (0..CURVE_TERMS).map(move |term| {
                let (sin, cos) = (term.div_ceil(2) as f64 * angle).sin_cos();
                (if term % 2 == 0 && term > 0 { -sin } else { cos }) as f32
            })
        })
        .collect();
    upload(&values, &[ANGLES as i64, CURVE_TERMS as i64], like)
}

/// Cuts off what is brighter than a few pixels, as a camera does.
fn clipped(curves: &Tensor, mask: &Tensor, turns: &[PlannedTurn]) -> Result<Tensor, TrainError> {
    let Some((numbers, at)) = chosen(turns, |one| one.plan.clipped.is_some(), curves)? else {
        return Ok(curves.shallow_clone());
    };
    let own = curves.f_index_select(0, &at)?;
    let parts: Vec<f32> = numbers
        .iter()
        .map(|&at| turns[at].plan.clipped.unwrap_or(1.0))
        .collect();
    let white = white_level(&own, &mask.f_index_select(0, &at)?, &parts)?;
    let size = own.size();
    let flat = own.f_reshape([size[0], size[1], -1])?;
    let terms = terms_at_angles(curves)?;
    let cut = terms
        .f_matmul(&flat)?
        .f_sub(&white)?
        .f_clamp_min(0.0)?
        .f_mul_scalar(1.0 / ANGLES as f64)?;
    // The mean once, the other terms twice: as a curve's Fourier coefficients are found.
    let twice = terms.f_mul_scalar(2.0)?;
    let _ = twice.f_narrow(1, 0, 1)?.f_fill_(1.0)?;
    let off = twice.f_transpose(0, 1)?.f_matmul(&cut)?;
    let own = flat.f_sub(&off)?.f_reshape(size)?;
    Ok(curves.f_index_copy(0, &at, &own)?)
}

/// The brightness below which a part of the object's pixels stay, `batch x 1 x 1`.
fn white_level(curves: &Tensor, mask: &Tensor, parts: &[f32]) -> Result<Tensor, TrainError> {
    let mean = curves.f_select(1, 0)?;
    let size = curves.size();
    let swings = curves.f_narrow(1, 1, size[1] - 1)?.f_reshape([
        size[0],
        (size[1] - 1) / 2,
        2,
        size[2],
        size[3],
        size[4],
    ])?;
    let swings = swings
        .f_square()?
        .f_sum_dim_intlist([2_i64].as_slice(), false, None)?
        .f_sqrt()?
        .f_sum_dim_intlist([1_i64].as_slice(), false, None)?;
    let brightest = mean.f_add(&swings)?.f_amax([1_i64], false)?;
    let inside = mask.f_flatten(1, -1)?;
    // What is outside comes first.
    let values = brightest
        .f_flatten(1, -1)?
        .f_add_scalar(1.0)?
        .f_mul(&inside)?;
    let (sorted, _) = values.f_sort(1, false)?;
    let pixels = sorted.size()[1];
    let count = inside.f_sum_dim_intlist([1_i64].as_slice(), true, None)?;
    let parts = columns(parts, parts.len(), curves)?.f_reshape([-1, 1])?;
    let above = count.f_mul(&parts.f_neg()?.f_add_scalar(1.0)?)?.f_ceil()?;
    let place = above
        .f_neg()?
        .f_add_scalar(pixels as f64)?
        .f_clamp(0.0, (pixels - 1) as f64)?
        .f_to_kind(tch::Kind::Int64)?;
    Ok(sorted
        .f_gather(1, &place, false)?
        .f_add_scalar(-1.0)?
        .f_unsqueeze(2)?)
}

/// The curves with errors of the table's angle.
fn mistimed(curves: &Tensor, turns: &[PlannedTurn]) -> Result<Tensor, TrainError> {
    let Some((numbers, at)) = chosen(turns, |one| one.plan.timing.is_some(), curves)? else {
        return Ok(curves.shallow_clone());
    };
    let matrices: Vec<f32> = numbers
        .iter()
        .filter_map(|&at| turns[at].plan.timing.as_ref())
        .flat_map(|matrix| matrix.as_flattened())
        .copied()
        .collect();
    let terms = CURVE_TERMS as i64;
    let matrices = upload(&matrices, &[numbers.len() as i64, terms, terms], curves)?;
    let own = curves.f_index_select(0, &at)?;
    let size = own.size();
    let own = matrices
        .f_bmm(&own.f_reshape([size[0], terms, -1])?)?
        .f_reshape(size)?;
    Ok(curves.f_index_copy(0, &at, &own)?)
}

/// Noise of the camera, of its compression, and of light that flickers.
fn noisy(
    curves: &Tensor,
    mask: &Tensor,
    turns: &[PlannedTurn],
    noise: &Tensor,
) -> Result<Tensor, TrainError> {
    let level = curves
        .f_select(1, 0)?
        .f_mean_dim([1_i64].as_slice(), true, None)?;
    let of = |which: usize| {
        let values: Vec<f32> = turns.iter().map(|one| one.plan.noise[which]).collect();
        columns(&values, turns.len(), curves)
    };
    let deviation = mean_over(&level, mask)?
        .f_mul(&of(0)?)?
        .f_add(&level.f_clamp_min(0.0)?.f_mul(&of(1)?)?)?
        .f_mul(mask)?
        .f_unsqueeze(1)?;
    let mut size = curves.size();
    size[1] -= 1;
    let swings = curves
        .f_narrow(1, 1, size[1])?
        .f_add(&noise.f_reshape(size)?.f_mul(&deviation)?)?;
    Ok(Tensor::f_cat(&[curves.f_narrow(1, 0, 1)?, swings], 1)?)
}

/// The left-right mirror images of those that are seen in one: there q, which a normal's azimuth turns, is -conj(q).
fn mirrored(lit: LitTurns, turns: &[PlannedTurn]) -> Result<LitTurns, TrainError> {
    let Some((_, at)) = chosen(turns, |one| one.plan.is_mirrored, &lit.curves)? else {
        return Ok(lit);
    };
    let flipped = |of: &Tensor, signs: Option<&Tensor>| -> Result<Tensor, TrainError> {
        let own = of.f_index_select(0, &at)?.f_flip([-1_i64])?;
        let own = match signs {
            Some(signs) => own.f_mul(signs)?,
            None => own,
        };
        Ok(of.f_index_copy(0, &at, &own)?)
    };
    let sign = |term: usize| match (term.div_ceil(2) % 2, term % 2) {
        (1, 1) | (0, 0) if term > 0 => -1.0,
        _ => 1.0,
    };
    let terms: Vec<f32> = (0..CURVE_TERMS).map(sign).collect();
    let terms = upload(&terms, &[1, CURVE_TERMS as i64, 1, 1, 1], &lit.curves)?;
    let axes = upload(&[-1.0, 1.0, 1.0], &[1, 3, 1, 1], &lit.curves)?;
    Ok(LitTurns {
        curves: flipped(&lit.curves, Some(&terms))?,
        normals: flipped(&lit.normals, Some(&axes))?,
        albedo: flipped(&lit.albedo, None)?,
        mask: flipped(&lit.mask, None)?,
    })
}
