//! Numbers as tensors, and what is computed of vectors and light at each pixel, `batch x channels x side x side`.

use tch::{Device, Tensor};

/// `Σ_lm transfer_lm L_lm`: lights `batch x coefficients x channels`, transfer `batch x coefficients x side x side`.
pub(crate) fn of_light(lights: &Tensor, transfer: &Tensor) -> Tensor {
    let size = transfer.size();
    let flat = transfer.reshape([size[0], size[1], -1]);
    lights
        .transpose(1, 2)
        .bmm(&flat)
        .reshape([size[0], -1, size[2], size[3]])
}

/// Numbers of each of `count` samples, as `count x numbers x 1 x 1`, on the device and of the kind of another tensor.
pub(crate) fn columns(values: &[f32], count: usize, like: &Tensor) -> Tensor {
    upload(values, &[count as i64, -1, 1, 1], like)
}

/// Numbers as a tensor on the device and of the kind of another one.
pub(crate) fn upload(values: &[f32], shape: &[i64], like: &Tensor) -> Tensor {
    Tensor::from_slice(values)
        .reshape(shape)
        .to_device(like.device())
        .to_kind(like.kind())
}

/// Indices as a tensor.
pub(crate) fn indices(of: impl Iterator<Item = usize>, device: Device) -> Tensor {
    let of: Vec<i64> = of.map(|at| at as i64).collect();
    Tensor::from_slice(&of).to_device(device)
}

/// Dot products over the channels.
pub(crate) fn dot(a: &Tensor, b: &Tensor) -> Tensor {
    (a * b).sum_dim_intlist([1_i64].as_slice(), true, None)
}

/// Vectors at length 1.
pub(crate) fn unit(of: &Tensor) -> Tensor {
    of * dot(of, of).clamp_min(1e-12).rsqrt()
}
