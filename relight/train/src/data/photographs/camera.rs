//! Cameras on the device: exposure, blur, noise, response, eight bits and JPEG, `batch x 3 x side x side`.

use tch::{Kind, Tensor};

use super::lit::PlannedPhoto;
use crate::data::noise::NoiseTiles;
use crate::data::tensors::{columns, indices, upload};
use crate::error::TrainError;
use relight_synth::PhotoCamera;

/// Part of the pixels that are darker than what a picture is exposed by.
const EXPOSED: f64 = 0.99;
/// By every so manieth row and column it is found.
const STEP: i64 = 2;
/// Pixels to each side of a blur's middle.
const REACH: i64 = 2;
/// sRGB (IEC 61966-2-1): where the power begins, in light and in values, and its numbers.
const LINEAR_LIGHT: f64 = 0.003_130_8;
const LINEAR_VALUE: f64 = 0.040_45;
const LINEAR_SLOPE: f64 = 12.92;
const OFFSET: f64 = 0.055;
const POWER: f64 = 2.4;

/// From light to camera values.
#[derive(Debug)]
pub(super) struct SimulatedPhotos {
    /// Linear light as whoever has the picture takes it, clipped at 1.
    pub(super) picture: Tensor,
    /// By which all light was multiplied, `batch x 3 x 1 x 1`.
    pub(super) gain: Tensor,
}

/// Photographs light (`image`) on the object (`mask`); `seeds` draw the noise.
pub(super) fn photograph(
    image: &Tensor,
    mask: &Tensor,
    photos: &[PlannedPhoto],
    (tiles, seeds): (&NoiseTiles, &[u64]),
) -> Result<SimulatedPhotos, TrainError> {
    let cameras: Vec<&PhotoCamera> = photos.iter().map(|photo| &photo.plan.camera).collect();
    let device = image.device();
    let balance: Vec<f32> = cameras.iter().flat_map(|camera| camera.balance).collect();
    let balance = columns(&balance, cameras.len(), image)?;
    let levels: Vec<f32> = cameras.iter().map(|camera| camera.level).collect();
    let levels = columns(&levels, cameras.len(), image)?;
    let brightest = percentile(&image.f_mul(&balance)?, mask)?;
    let gain = balance.f_mul(&levels.f_div(&brightest)?)?;
    let light = image.f_mul(&gain)?;
    let light = changed(
        &light,
        &cameras,
        |camera| camera.blur > 0.0,
        |light, chosen| {
            let inside = mask.f_index_select(0, &indices(chosen.iter().copied(), device)?)?;
            blurred(light, &inside, &picked(&cameras, chosen))
        },
    )?;
    let is_noisy = |camera: &PhotoCamera| camera.read_noise > 0.0 || camera.shot_noise > 0.0;
    let light = changed(&light, &cameras, is_noisy, |light, chosen| {
        let seeds: Vec<u64> = chosen.iter().map(|&at| seeds[at]).collect();
        noisy(
            light,
            &tiles.of(&seeds, light.kind())?,
            &picked(&cameras, chosen),
        )
    })?;
    let light = light.f_clamp(0.0, 1.0)?;
    let values = changed(
        &light,
        &cameras,
        |camera| camera.gamma.is_none(),
        |light, _| srgb_value(light),
    )?;
    let by_power = |camera: &PhotoCamera| camera.gamma.is_some();
    let values = changed(&values, &cameras, by_power, |light, chosen| {
        let powers = picked(&cameras, chosen);
        let powers: Vec<f32> = powers
            .iter()
            .map(|one| 1.0 / one.gamma.unwrap_or(1.0))
            .collect();
        Ok(light.f_pow(&columns(&powers, powers.len(), light)?)?)
    })?;
    let values = values.f_mul_scalar(255.0)?.f_round()?;
    let values = changed(
        &values,
        &cameras,
        |camera| camera.jpeg.is_some(),
        |values, chosen| super::jpeg::compressed(values, &picked(&cameras, chosen)),
    )?;
    let values = values.f_mul_scalar(1.0 / 255.0)?;
    let is_srgb = |camera: &PhotoCamera| camera.gamma.is_none() || camera.taken_as_srgb;
    let picture = changed(&values, &cameras, is_srgb, |values, _| srgb_light(values))?;
    let picture = changed(
        &picture,
        &cameras,
        |camera| !is_srgb(camera),
        |values, chosen| {
            let powers = picked(&cameras, chosen);
            let powers: Vec<f32> = powers.iter().map(|one| one.gamma.unwrap_or(1.0)).collect();
            Ok(values.f_pow(&columns(&powers, powers.len(), values)?)?)
        },
    )?;
    Ok(SimulatedPhotos {
        picture: picture.f_mul(mask)?,
        gain,
    })
}

fn picked<'a>(cameras: &[&'a PhotoCamera], chosen: &[usize]) -> Vec<&'a PhotoCamera> {
    chosen.iter().map(|&at| cameras[at]).collect()
}

/// A batch in which those photographs are changed whose cameras ask for it.
fn changed(
    batch: &Tensor,
    cameras: &[&PhotoCamera],
    is_asked: impl Fn(&PhotoCamera) -> bool,
    change: impl Fn(&Tensor, &[usize]) -> Result<Tensor, TrainError>,
) -> Result<Tensor, TrainError> {
    let chosen: Vec<usize> = (0..cameras.len())
        .filter(|&at| is_asked(cameras[at]))
        .collect();
    if chosen.is_empty() {
        return Ok(batch.shallow_clone());
    }
    let at = indices(chosen.iter().copied(), batch.device())?;
    let changed = change(&batch.f_index_select(0, &at)?, &chosen)?;
    Ok(batch.f_index_copy(0, &at, &changed)?)
}

/// The level below which the brightest channel of 99 in 100 of the object's pixels lies, `batch x 1 x 1 x 1`, above 0.
pub(super) fn percentile(image: &Tensor, mask: &Tensor) -> Result<Tensor, TrainError> {
    let sampled = |of: &Tensor| {
        of.f_slice(2, None, None, STEP)?
            .f_slice(3, None, None, STEP)
    };
    let brightest = sampled(image)?.f_amax([1_i64], true)?;
    let inside = sampled(mask)?.f_flatten(1, -1)?;
    // What is outside comes first.
    let values = brightest
        .f_flatten(1, -1)?
        .f_add_scalar(1.0)?
        .f_mul(&inside)?
        .f_add_scalar(-1.0)?;
    let (sorted, _) = values.f_sort(1, false)?;
    let count = inside.f_sum_dim_intlist([1_i64].as_slice(), true, None)?;
    let last = sorted.size()[1] - 1;
    let above = count.f_mul_scalar(1.0 - EXPOSED)?.f_floor()?;
    let place = above
        .f_neg()?
        .f_add_scalar(last as f64)?
        .f_to_kind(Kind::Int64)?;
    Ok(sorted
        .f_gather(1, &place, false)?
        .f_clamp_min(1e-6)?
        .f_reshape([-1, 1, 1, 1])?)
}

/// Blurred by a Gaussian; the object's edge stays where it is.
fn blurred(light: &Tensor, mask: &Tensor, cameras: &[&PhotoCamera]) -> Result<Tensor, TrainError> {
    let kernel = |camera: &PhotoCamera| {
        let weights: Vec<f32> = (-REACH..=REACH)
            .map(|at| (-0.5 * (at as f32 / camera.blur).powi(2)).exp())
            .collect();
        let sum: f32 = weights.iter().sum();
        weights.into_iter().map(move |weight| weight / sum)
    };
    let kernels: Vec<f32> = cameras.iter().flat_map(|camera| kernel(camera)).collect();
    let (count, width) = (cameras.len() as i64, 2 * REACH + 1);
    let kernels = upload(&kernels, &[count, 1, 1, width], light)?;
    let smooth = |of: &Tensor, planes: i64| -> Result<Tensor, tch::TchError> {
        let size = of.size();
        let flat = of.f_reshape([1, count * planes, size[2], size[3]])?;
        let along = kernels.f_repeat_interleave_self_int(planes, 0, Some(count * planes))?;
        let across = along.f_transpose(2, 3)?.f_contiguous()?;
        let none = None::<Tensor>;
        flat.f_conv2d(&along, none.as_ref(), [1], [0, REACH], [1], count * planes)?
            .f_conv2d(&across, none.as_ref(), [1], [REACH, 0], [1], count * planes)?
            .f_reshape(size)
    };
    let weight = smooth(mask, 1)?.f_clamp_min(1e-6)?;
    Ok(smooth(&light.f_mul(mask)?, 3)?.f_div(&weight)?)
}

fn noisy(light: &Tensor, noise: &Tensor, cameras: &[&PhotoCamera]) -> Result<Tensor, TrainError> {
    let of = |value: fn(&PhotoCamera) -> f32| {
        let values: Vec<f32> = cameras.iter().map(|camera| value(camera)).collect();
        columns(&values, cameras.len(), light)
    };
    let shot = of(|camera| camera.shot_noise)?.f_mul(&light.f_clamp_min(0.0)?.f_sqrt()?)?;
    let deviation = shot.f_add(&of(|camera| camera.read_noise)?)?;
    Ok(light.f_add(&noise.f_mul(&deviation)?)?)
}

fn srgb_value(light: &Tensor) -> Result<Tensor, TrainError> {
    let power = light
        .f_clamp_min(LINEAR_LIGHT)?
        .f_pow_tensor_scalar(1.0 / POWER)?
        .f_mul_scalar(1.0 + OFFSET)?
        .f_add_scalar(-OFFSET)?;
    let line = light.f_mul_scalar(LINEAR_SLOPE)?;
    Ok(line.f_where_self(&light.f_le(LINEAR_LIGHT)?, &power)?)
}

fn srgb_light(value: &Tensor) -> Result<Tensor, TrainError> {
    let power = value
        .f_clamp_min(LINEAR_VALUE)?
        .f_add_scalar(OFFSET)?
        .f_mul_scalar(1.0 / (1.0 + OFFSET))?
        .f_pow_tensor_scalar(POWER)?;
    let line = value.f_mul_scalar(1.0 / LINEAR_SLOPE)?;
    Ok(line.f_where_self(&value.f_le(LINEAR_VALUE)?, &power)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::image::{ColourSpace, Srgb};

    #[test]
    fn the_response_is_that_of_srgb_both_ways() {
        let light: Vec<f32> = (0..=200).map(|k| k as f32 / 200.0).collect();
        let values = srgb_value(&Tensor::from_slice(&light)).unwrap();
        let back = Vec::<f32>::try_from(srgb_light(&values).unwrap()).unwrap();
        let values = Vec::<f32>::try_from(values).unwrap();
        for ((light, value), back) in light.into_iter().zip(values).zip(back) {
            assert!((value - Srgb::from_linear(light)).abs() < 1e-5, "{light}");
            assert!((light - back).abs() < 1e-5, "{light}");
        }
    }

    #[test]
    fn a_percentile_counts_the_object_only() {
        let ramp: Vec<f32> = (0..64 * 64).map(|k| (k / 64) as f32 / 64.0).collect();
        let image = Tensor::from_slice(&ramp)
            .reshape([1, 1, 64, 64])
            .repeat([1, 3, 1, 1]);
        let all = Tensor::ones([1, 1, 64, 64], (Kind::Float, tch::Device::Cpu));
        let found = |mask: &Tensor| {
            percentile(&image, mask)
                .unwrap()
                .double_value(&[0, 0, 0, 0])
        };
        assert!((found(&all) - 62.0 / 64.0).abs() < 0.02);
        let upper = Tensor::cat(&[all.narrow(2, 0, 16), all.narrow(2, 0, 48) * 0.0], 2);
        assert!((found(&upper) - 14.0 / 64.0).abs() < 0.02);
    }

    #[test]
    fn the_noise_has_no_bias_and_the_deviation_of_the_camera() {
        let tiles = NoiseTiles::new((3, 64), 3, tch::Device::Cpu).unwrap();
        let noise = tiles.of(&[5, 9], Kind::Float).unwrap();
        assert!(noise.mean(Kind::Float).double_value(&[]).abs() < 0.02);
        assert!((noise.std(true).double_value(&[]) - 1.0).abs() < 0.02);
        let [one, other] = [0, 1].map(|at| noise.get(at));
        assert_ne!(one, other);
    }
}
