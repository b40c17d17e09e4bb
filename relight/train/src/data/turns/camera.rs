//! What a rig makes of curves, on the device: highlights that clip, errors of the table's angle, noise, and the mirror image.

use std::f64::consts::TAU;

use relight_synth::CURVE_TERMS;
use tch::Tensor;

use super::lit::{LitTurns, PlannedTurn, mean_over};
use crate::engine::tensors::{columns, grey, indices, over_channels, upload};

/// Values of a curve at which clipping is looked at.
const ANGLES: usize = 36;

/// Turns as they are filmed; `noise` has a standard deviation of 1, `batch x (terms - 1) 3 x side x side`.
pub(super) fn filmed(lit: LitTurns, turns: &[PlannedTurn], noise: &Tensor) -> LitTurns {
    let curves = clipped(&lit.curves, &lit.mask, turns);
    let curves = mistimed(&curves, turns);
    let curves = noisy(&curves, &lit.mask, turns, noise);
    mirrored(LitTurns { curves, ..lit }, turns)
}

/// The numbers of those turns of a batch that ask for something; none if there are none.
fn chosen(
    turns: &[PlannedTurn],
    is_asked: impl Fn(&PlannedTurn) -> bool,
    like: &Tensor,
) -> Option<(Vec<usize>, Tensor)> {
    let numbers: Vec<usize> = (0..turns.len())
        .filter(|&at| is_asked(&turns[at]))
        .collect();
    if numbers.is_empty() {
        return None;
    }
    let at = indices(numbers.iter().copied(), like.device());
    Some((numbers, at))
}

/// `values x terms`: `1, cos a, -sin a, cos 2a, -sin 2a` and so on at angles around the turn.
fn terms_at_angles(like: &Tensor) -> Tensor {
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
fn clipped(curves: &Tensor, mask: &Tensor, turns: &[PlannedTurn]) -> Tensor {
    let Some((numbers, at)) = chosen(turns, |one| one.plan.clipped.is_some(), curves) else {
        return curves.shallow_clone();
    };
    let own = curves.index_select(0, &at);
    let parts: Vec<f32> = numbers
        .iter()
        .map(|&at| turns[at].plan.clipped.unwrap_or(1.0))
        .collect();
    let white = white_level(&own, &mask.index_select(0, &at), &parts);
    let size = own.size();
    let flat = own.reshape([size[0], size[1], -1]);
    let terms = terms_at_angles(curves);
    let cut = (terms.matmul(&flat) - &white).clamp_min(0.0) * (1.0 / ANGLES as f64);
    // The mean once, the other terms twice: as a curve's Fourier coefficients are found.
    let twice = &terms * 2.0;
    let _ = twice.narrow(1, 0, 1).fill_(1.0);
    let off = twice.transpose(0, 1).matmul(&cut);
    let own = (&flat - &off).reshape(size);
    curves.index_copy(0, &at, &own)
}

/// The brightness below which a part of the object's pixels stay, `batch x 1 x 1`.
fn white_level(curves: &Tensor, mask: &Tensor, parts: &[f32]) -> Tensor {
    let mean = curves.select(1, 0);
    let size = curves.size();
    let swings = curves.narrow(1, 1, size[1] - 1).reshape([
        size[0],
        (size[1] - 1) / 2,
        2,
        size[2],
        size[3],
        size[4],
    ]);
    let swings = swings
        .square()
        .sum_dim_intlist([2_i64].as_slice(), false, None)
        .sqrt()
        .sum_dim_intlist([1_i64].as_slice(), false, None);
    let brightest = (&mean + &swings).amax([1_i64], false);
    let inside = mask.flatten(1, -1);
    // What is outside comes first.
    let values = (brightest.flatten(1, -1) + 1.0) * &inside;
    let (sorted, _) = values.sort(1, false);
    let pixels = sorted.size()[1];
    let count = over_channels(&inside);
    let parts = columns(parts, parts.len(), curves).reshape([-1, 1]);
    let above = (&count * (-&parts + 1.0)).ceil();
    let place = (-&above + pixels as f64)
        .clamp(0.0, (pixels - 1) as f64)
        .to_kind(tch::Kind::Int64);
    (sorted.gather(1, &place, false) - 1.0).unsqueeze(2)
}

/// The curves with errors of the table's angle.
fn mistimed(curves: &Tensor, turns: &[PlannedTurn]) -> Tensor {
    let Some((numbers, at)) = chosen(turns, |one| one.plan.timing.is_some(), curves) else {
        return curves.shallow_clone();
    };
    let matrices: Vec<f32> = numbers
        .iter()
        .filter_map(|&at| turns[at].plan.timing.as_ref())
        .flat_map(|matrix| matrix.as_flattened())
        .copied()
        .collect();
    let terms = CURVE_TERMS as i64;
    let matrices = upload(&matrices, &[numbers.len() as i64, terms, terms], curves);
    let own = curves.index_select(0, &at);
    let size = own.size();
    let own = matrices
        .bmm(&own.reshape([size[0], terms, -1]))
        .reshape(size);
    curves.index_copy(0, &at, &own)
}

/// Noise of the camera, of its compression, and of light that flickers.
fn noisy(curves: &Tensor, mask: &Tensor, turns: &[PlannedTurn], noise: &Tensor) -> Tensor {
    let level = grey(&curves.select(1, 0));
    let of = |which: usize| {
        let values: Vec<f32> = turns.iter().map(|one| one.plan.noise[which]).collect();
        columns(&values, turns.len(), curves)
    };
    let deviation =
        ((mean_over(&level, mask) * of(0) + level.clamp_min(0.0) * of(1)) * mask).unsqueeze(1);
    let mut size = curves.size();
    size[1] -= 1;
    let swings = curves.narrow(1, 1, size[1]) + noise.reshape(size) * &deviation;
    Tensor::cat(&[curves.narrow(1, 0, 1), swings], 1)
}

/// The left-right mirror images of those that are seen in one: there q, which a normal's azimuth turns, is -conj(q).
fn mirrored(lit: LitTurns, turns: &[PlannedTurn]) -> LitTurns {
    let Some((_, at)) = chosen(turns, |one| one.plan.is_mirrored, &lit.curves) else {
        return lit;
    };
    let flipped = |of: &Tensor, signs: Option<&Tensor>| {
        let own = of.index_select(0, &at).flip([-1_i64]);
        let own = match signs {
            Some(signs) => &own * signs,
            None => own,
        };
        of.index_copy(0, &at, &own)
    };
    let sign = |term: usize| match (term.div_ceil(2) % 2, term % 2) {
        (1, 1) | (0, 0) if term > 0 => -1.0,
        _ => 1.0,
    };
    let terms: Vec<f32> = (0..CURVE_TERMS).map(sign).collect();
    let terms = upload(&terms, &[1, CURVE_TERMS as i64, 1, 1, 1], &lit.curves);
    let axes = upload(&[-1.0, 1.0, 1.0], &[1, 3, 1, 1], &lit.curves);
    LitTurns {
        curves: flipped(&lit.curves, Some(&terms)),
        normals: flipped(&lit.normals, Some(&axes)),
        albedo: flipped(&lit.albedo, None),
        mask: flipped(&lit.mask, None),
    }
}
