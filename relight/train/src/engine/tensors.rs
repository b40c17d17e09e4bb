//! Numbers as tensors, and what is computed of vectors and light at each pixel, `batch x channels x side x side`.

use tch::{Device, Tensor};

/// sRGB (IEC 61966-2-1): where the power begins, in light and in values, and its numbers.
const LINEAR_LIGHT: f64 = 0.003_130_8;
const LINEAR_VALUE: f64 = 0.040_45;
const LINEAR_SLOPE: f64 = 12.92;
const OFFSET: f64 = 0.055;
const POWER: f64 = 2.4;

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

/// Sums over the channels.
pub(crate) fn over_channels(of: &Tensor) -> Tensor {
    of.sum_dim_intlist([1_i64].as_slice(), true, None)
}

/// Means over the channels.
pub(crate) fn grey(of: &Tensor) -> Tensor {
    of.mean_dim([1_i64].as_slice(), true, None)
}

/// Dot products over the channels.
pub(crate) fn dot(a: &Tensor, b: &Tensor) -> Tensor {
    over_channels(&(a * b))
}

/// Vectors at length 1.
pub(crate) fn unit(of: &Tensor) -> Tensor {
    of * dot(of, of).clamp_min(1e-12).rsqrt()
}

/// sRGB values of linear light.
pub(crate) fn srgb_value(light: &Tensor) -> Tensor {
    let power =
        light.clamp_min(LINEAR_LIGHT).pow_tensor_scalar(1.0 / POWER) * (1.0 + OFFSET) - OFFSET;
    let line = light * LINEAR_SLOPE;
    line.where_self(&light.le(LINEAR_LIGHT), &power)
}

/// Linear light of sRGB values.
pub(crate) fn srgb_light(value: &Tensor) -> Tensor {
    let power = ((value.clamp_min(LINEAR_VALUE) + OFFSET) * (1.0 / (1.0 + OFFSET)))
        .pow_tensor_scalar(POWER);
    let line = value * (1.0 / LINEAR_SLOPE);
    line.where_self(&value.le(LINEAR_VALUE), &power)
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::image::{ColourSpace, Srgb};

    #[test]
    fn the_response_is_that_of_srgb_both_ways() {
        let light: Vec<f32> = (0..=200).map(|k| k as f32 / 200.0).collect();
        let values = srgb_value(&Tensor::from_slice(&light));
        let back = Vec::<f32>::try_from(srgb_light(&values)).unwrap();
        let values = Vec::<f32>::try_from(values).unwrap();
        for ((light, value), back) in light.into_iter().zip(values).zip(back) {
            assert!((value - Srgb::from_linear(light)).abs() < 1e-5, "{light}");
            assert!((light - back).abs() < 1e-5, "{light}");
        }
    }
}
