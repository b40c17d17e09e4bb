//! Numbers as tensors, and what is computed of vectors and light at each pixel, `batch x channels x side x side`.

use tch::{Device, Tensor};

use crate::error::TrainError;

/// `Σ_lm transfer_lm L_lm`: lights `batch x coefficients x channels`, transfer `batch x coefficients x side x side`.
pub(crate) fn of_light(lights: &Tensor, transfer: &Tensor) -> Result<Tensor, TrainError> {
    let size = transfer.size();
    let flat = transfer.f_reshape([size[0], size[1], -1])?;
    Ok(lights
        .f_transpose(1, 2)?
        .f_bmm(&flat)?
        .f_reshape([size[0], -1, size[2], size[3]])?)
}

/// Numbers of each of `count` samples, as `count x numbers x 1 x 1`, on the device and of the kind of another tensor.
pub(crate) fn columns(values: &[f32], count: usize, like: &Tensor) -> Result<Tensor, TrainError> {
    upload(values, &[count as i64, -1, 1, 1], like)
}

/// Numbers as a tensor on the device and of the kind of another one.
pub(crate) fn upload(values: &[f32], shape: &[i64], like: &Tensor) -> Result<Tensor, TrainError> {
    Ok(Tensor::f_from_slice(values)?
        .f_reshape(shape)?
        .f_to_device(like.device())?
        .f_to_kind(like.kind())?)
}

/// Indices as a tensor.
pub(crate) fn indices(
    of: impl Iterator<Item = usize>,
    device: Device,
) -> Result<Tensor, TrainError> {
    let of: Vec<i64> = of.map(|at| at as i64).collect();
    Ok(Tensor::f_from_slice(&of)?.f_to_device(device)?)
}

/// Dot products over the channels.
pub(crate) fn dot(a: &Tensor, b: &Tensor) -> Result<Tensor, TrainError> {
    Ok(a.f_mul(b)?
        .f_sum_dim_intlist([1_i64].as_slice(), true, None)?)
}

/// Vectors at length 1.
pub(crate) fn unit(of: &Tensor) -> Result<Tensor, TrainError> {
    Ok(of.f_mul(&dot(of, of)?.f_clamp_min(1e-12)?.f_rsqrt()?)?)
}
