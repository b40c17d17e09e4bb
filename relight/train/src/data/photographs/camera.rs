//! Cameras on the device: exposure, blur, noise, response, eight bits and JPEG, `batch x 3 x side x side`.

use tch::{Kind, Tensor};

use super::lit::PlannedPhoto;
use crate::data::noise::NoiseTiles;
use crate::engine::tensors::{columns, indices, over_channels, srgb_light, srgb_value, upload};
use relight_synth::PhotoCamera;

/// Part of the pixels that are darker than what a picture is exposed by.
const EXPOSED: f64 = 0.99;
/// By every so manieth row and column it is found.
const STEP: i64 = 2;
/// Pixels to each side of a blur's middle.
const REACH: i64 = 2;

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
) -> SimulatedPhotos {
    let cameras: Vec<&PhotoCamera> = photos.iter().map(|photo| &photo.plan.camera).collect();
    let device = image.device();
    let balance: Vec<f32> = cameras.iter().flat_map(|camera| camera.balance).collect();
    let balance = columns(&balance, cameras.len(), image);
    let levels: Vec<f32> = cameras.iter().map(|camera| camera.level).collect();
    let levels = columns(&levels, cameras.len(), image);
    let brightest = percentile(&(image * &balance), mask);
    let gain = &balance * (&levels / &brightest);
    let light = image * &gain;
    let light = changed(
        &light,
        &cameras,
        |camera| camera.blur > 0.0,
        |light, chosen| {
            let inside = mask.index_select(0, &indices(chosen.iter().copied(), device));
            blurred(light, &inside, &picked(&cameras, chosen))
        },
    );
    let is_noisy = |camera: &PhotoCamera| camera.read_noise > 0.0 || camera.shot_noise > 0.0;
    let light = changed(&light, &cameras, is_noisy, |light, chosen| {
        let seeds: Vec<u64> = chosen.iter().map(|&at| seeds[at]).collect();
        noisy(
            light,
            &tiles.of(&seeds, light.kind()),
            &picked(&cameras, chosen),
        )
    });
    let light = light.clamp(0.0, 1.0);
    let values = changed(
        &light,
        &cameras,
        |camera| camera.gamma.is_none(),
        |light, _| srgb_value(light),
    );
    let by_power = |camera: &PhotoCamera| camera.gamma.is_some();
    let values = changed(&values, &cameras, by_power, |light, chosen| {
        let powers = picked(&cameras, chosen);
        let powers: Vec<f32> = powers
            .iter()
            .map(|one| 1.0 / one.gamma.unwrap_or(1.0))
            .collect();
        light.pow(&columns(&powers, powers.len(), light))
    });
    let values = (&values * 255.0).round();
    let values = changed(
        &values,
        &cameras,
        |camera| camera.jpeg.is_some(),
        |values, chosen| super::jpeg::compressed(values, &picked(&cameras, chosen)),
    );
    let values = &values * (1.0 / 255.0);
    let is_srgb = |camera: &PhotoCamera| camera.gamma.is_none() || camera.taken_as_srgb;
    let picture = changed(&values, &cameras, is_srgb, |values, _| srgb_light(values));
    let picture = changed(
        &picture,
        &cameras,
        |camera| !is_srgb(camera),
        |values, chosen| {
            let powers = picked(&cameras, chosen);
            let powers: Vec<f32> = powers.iter().map(|one| one.gamma.unwrap_or(1.0)).collect();
            values.pow(&columns(&powers, powers.len(), values))
        },
    );
    SimulatedPhotos {
        picture: &picture * mask,
        gain,
    }
}

fn picked<'a>(cameras: &[&'a PhotoCamera], chosen: &[usize]) -> Vec<&'a PhotoCamera> {
    chosen.iter().map(|&at| cameras[at]).collect()
}

/// A batch in which those photographs are changed whose cameras ask for it.
fn changed(
    batch: &Tensor,
    cameras: &[&PhotoCamera],
    is_asked: impl Fn(&PhotoCamera) -> bool,
    change: impl Fn(&Tensor, &[usize]) -> Tensor,
) -> Tensor {
    let chosen: Vec<usize> = (0..cameras.len())
        .filter(|&at| is_asked(cameras[at]))
        .collect();
    if chosen.is_empty() {
        return batch.shallow_clone();
    }
    let at = indices(chosen.iter().copied(), batch.device());
    let changed = change(&batch.index_select(0, &at), &chosen);
    batch.index_copy(0, &at, &changed)
}

/// The level below which the brightest channel of 99 in 100 of the object's pixels lies, `batch x 1 x 1 x 1`, above 0.
pub(super) fn percentile(image: &Tensor, mask: &Tensor) -> Tensor {
    let sampled = |of: &Tensor| of.slice(2, None, None, STEP).slice(3, None, None, STEP);
    let brightest = sampled(image).amax([1_i64], true);
    let inside = sampled(mask).flatten(1, -1);
    // What is outside comes first.
    let values = (brightest.flatten(1, -1) + 1.0) * &inside - 1.0;
    let (sorted, _) = values.sort(1, false);
    let count = over_channels(&inside);
    let last = sorted.size()[1] - 1;
    let above = (&count * (1.0 - EXPOSED)).floor();
    let place = (-&above + last as f64).to_kind(Kind::Int64);
    sorted
        .gather(1, &place, false)
        .clamp_min(1e-6)
        .reshape([-1, 1, 1, 1])
}

/// Blurred by a Gaussian; the object's edge stays where it is.
fn blurred(light: &Tensor, mask: &Tensor, cameras: &[&PhotoCamera]) -> Tensor {
    let kernel = |camera: &PhotoCamera| {
        let weights: Vec<f32> = (-REACH..=REACH)
            .map(|at| (-0.5 * (at as f32 / camera.blur).powi(2)).exp())
            .collect();
        let sum: f32 = weights.iter().sum();
        weights.into_iter().map(move |weight| weight / sum)
    };
    let kernels: Vec<f32> = cameras.iter().flat_map(|camera| kernel(camera)).collect();
    let (count, width) = (cameras.len() as i64, 2 * REACH + 1);
    let kernels = upload(&kernels, &[count, 1, 1, width], light);
    let smooth = |of: &Tensor, planes: i64| {
        let size = of.size();
        let flat = of.reshape([1, count * planes, size[2], size[3]]);
        let along = kernels.repeat_interleave_self_int(planes, 0, Some(count * planes));
        let across = along.transpose(2, 3).contiguous();
        let none = None::<Tensor>;
        flat.conv2d(&along, none.as_ref(), [1], [0, REACH], [1], count * planes)
            .conv2d(&across, none.as_ref(), [1], [REACH, 0], [1], count * planes)
            .reshape(size)
    };
    let weight = smooth(mask, 1).clamp_min(1e-6);
    smooth(&(light * mask), 3) / &weight
}

fn noisy(light: &Tensor, noise: &Tensor, cameras: &[&PhotoCamera]) -> Tensor {
    let of = |value: fn(&PhotoCamera) -> f32| {
        let values: Vec<f32> = cameras.iter().map(|camera| value(camera)).collect();
        columns(&values, cameras.len(), light)
    };
    let shot = of(|camera| camera.shot_noise) * light.clamp_min(0.0).sqrt();
    let deviation = &shot + of(|camera| camera.read_noise);
    light + noise * &deviation
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_percentile_counts_the_object_only() {
        let ramp: Vec<f32> = (0..64 * 64).map(|k| (k / 64) as f32 / 64.0).collect();
        let image = Tensor::from_slice(&ramp)
            .reshape([1, 1, 64, 64])
            .repeat([1, 3, 1, 1]);
        let all = Tensor::ones([1, 1, 64, 64], (Kind::Float, tch::Device::Cpu));
        let found = |mask: &Tensor| percentile(&image, mask).double_value(&[0, 0, 0, 0]);
        assert!((found(&all) - 62.0 / 64.0).abs() < 0.02);
        let upper = Tensor::cat(&[all.narrow(2, 0, 16), all.narrow(2, 0, 48) * 0.0], 2);
        assert!((found(&upper) - 14.0 / 64.0).abs() < 0.02);
    }

    #[test]
    fn the_noise_has_no_bias_and_the_deviation_of_the_camera() {
        let tiles = NoiseTiles::new((3, 64), 3, tch::Device::Cpu);
        let noise = tiles.of(&[5, 9], Kind::Float);
        assert!(noise.mean(Kind::Float).double_value(&[]).abs() < 0.02);
        assert!((noise.std(true).double_value(&[]) - 1.0).abs() < 0.02);
        let [one, other] = [0, 1].map(|at| noise.get(at));
        assert_ne!(one, other);
    }
}
