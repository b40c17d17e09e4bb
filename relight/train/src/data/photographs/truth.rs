//! From lit and photographed views to the network's input and ground truth.

use relight_core::render::cosine_lobe;
use relight_photo::decompose::{LOG_FLOOR, MAX_LIGHT};
use relight_photo::nets::LIGHT_OUTPUTS;
use tch::Tensor;

use super::camera::{SimulatedPhotos, percentile};
use super::lit::{LitBatch, PlannedPhoto};
use crate::data::sample::TruthBatch;
use crate::data::symmetry::Symmetry;
use crate::engine::tensors::{grey, over_channels, upload};

/// The power of the encoded colour.
const ENCODED: f64 = 1.0 / 2.2;

/// A batch as a network learns from it, seen in one of the eight symmetries.
pub(super) fn truth(
    lit: &LitBatch,
    photographed: &SimulatedPhotos,
    photos: &[PlannedPhoto],
    symmetry: Symmetry,
) -> TruthBatch {
    let mask = &lit.mask;
    let over = |of: &Tensor, dims: &[i64]| of.sum_dim_intlist(dims, true, None);
    let covered = over(mask, &[2, 3]).clamp_min(1.0);
    let shading = &lit.shading * &photographed.gain;
    let grey = grey(&shading);
    let mean = (over(&grey, &[2, 3]) / &covered).clamp_min(1e-6);
    let white = percentile(&photographed.picture, mask);
    let picture = &photographed.picture / &white;

    // What a highlight adds to a picture that is clipped at 1.
    let diffuse = &lit.albedo * &shading;
    let highlight = &lit.highlight * &photographed.gain;
    let shown = ((&diffuse + &highlight).clamp_max(1.0) - diffuse.clamp_max(1.0)).mean_dim(
        [1_i64].as_slice(),
        true,
        None,
    ) / &white;

    let seen = |of: &Tensor| seen_in(of, symmetry);
    let normals = turned_normals(&(&lit.normals * mask), symmetry);
    TruthBatch {
        input: seen(&encoded(&picture, mask)),
        mask: seen(mask),
        picture: seen(&picture),
        shading: seen(&(&grey / &mean)),
        albedo: seen(&lit.albedo),
        normals: seen(&normals),
        highlight: seen(&shown),
        light: light(photos, &photographed.gain, &mean, symmetry),
    }
}

/// The input of the decomposing network, as [`relight_photo::decompose::NetworkInput`] makes it one by one.
pub(crate) fn encoded(picture: &Tensor, mask: &Tensor) -> Tensor {
    let light = picture.clamp(0.0, f64::from(MAX_LIGHT));
    let colour = light.pow_tensor_scalar(ENCODED) * 2.0 - 1.0;
    let sum = over_channels(&light);
    let mean = &sum * (1.0 / 3.0);
    let log = ((&mean + f64::from(LOG_FLOOR)).log() + 2.0) * 0.5;
    let chroma = (light.narrow(1, 0, 2) - &mean) * 4.0 / (&sum + 0.03);
    let all = Tensor::cat(&[colour, mask.shallow_clone(), log, chroma], 1);
    &all * mask
}

/// What the head for light should predict, `batch x 9`.
fn light(photos: &[PlannedPhoto], gain: &Tensor, mean: &Tensor, symmetry: Symmetry) -> Tensor {
    let count = photos.len() as i64;
    let values: Vec<f32> = photos
        .iter()
        .flat_map(|one| one.plan.light.as_flattened().iter().copied())
        .collect();
    let lights = upload(&values, &[count, LIGHT_OUTPUTS as i64, 3], gain);
    let grey = (&lights * gain.reshape([count, 1, 3])).mean_dim([2_i64].as_slice(), false, None);
    // The coefficients in their new order, with their signs: each number of this list is a place from 1 on.
    let places = symmetry.light([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0_f32]);
    let order: Vec<i64> = places.iter().map(|at| at.abs() as i64 - 1).collect();
    let factors: Vec<f32> = (0..LIGHT_OUTPUTS)
        .map(|at| cosine_lobe(at.isqrt()) as f32 * places[at].signum())
        .collect();
    let order = Tensor::from_slice(&order).to_device(gain.device());
    let factors = Tensor::from_slice(&factors).to_device(gain.device());
    grey.index_select(1, &order) * &factors / mean.reshape([count, 1])
}

/// Planes as they are seen in a symmetry.
fn seen_in(of: &Tensor, symmetry: Symmetry) -> Tensor {
    let mut axes = Vec::new();
    if symmetry.mirrored {
        axes.push(3_i64);
    }
    if symmetry.upside_down {
        axes.push(2);
    }
    let flipped = if axes.is_empty() {
        of.shallow_clone()
    } else {
        of.flip(axes)
    };
    if symmetry.transposed {
        return flipped.transpose(2, 3).contiguous();
    }
    flipped
}

/// Normals whose components are those of the symmetry; their places are still the old ones.
fn turned_normals(normals: &Tensor, symmetry: Symmetry) -> Tensor {
    let components: Vec<Tensor> = (0..3)
        .map(|axis| {
            let (from, sign) = symmetry.component(axis);
            normals.narrow(1, from as i64, 1) * f64::from(sign)
        })
        .collect();
    Tensor::cat(&components, 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::image::{Extent, Planes};
    use relight_photo::decompose::NetworkInput;

    #[test]
    fn pictures_are_encoded_on_tensors_as_one_by_one() {
        let side = 32;
        let picture = Planes::from_fn(Extent::new(side, side), |x, y| {
            [x, y, x + y].map(|v| (v as f32 / 40.0).powi(2))
        });
        let mask = Planes::from_fn(Extent::new(side, side), |x, _| [f32::from(u8::from(x > 9))]);
        let one = NetworkInput::new(&picture, &mask);
        let tensor = |planes: Vec<f32>, channels: i64| {
            Tensor::from_slice(&planes).reshape([1, channels, 32, 32])
        };
        let all: Vec<f32> = picture.planes().into_iter().flatten().copied().collect();
        let whites = tensor(all, 3) / f64::from(one.white());
        let found = encoded(&whites, &tensor(mask.plane(0).to_vec(), 1));
        let found = Vec::<f32>::try_from(found.flatten(0, -1)).unwrap();
        for (found, expected) in found.iter().zip(one.values()) {
            assert!((found - expected).abs() < 1e-4, "{found} {expected}");
        }
    }

    #[test]
    fn a_batch_is_seen_in_a_symmetry_as_the_symmetry_says() {
        let extent = Extent::new(4, 4);
        let values: Vec<f32> = (0..48).map(|at| at as f32).collect();
        let planes = Tensor::from_slice(&values).reshape([1, 3, 4, 4]);
        for bits in 0..8 {
            let symmetry = Symmetry::from_bits(bits);
            let seen = |of: &Tensor| seen_in(of, symmetry);
            let found = Vec::<f32>::try_from(seen(&planes).flatten(0, -1)).unwrap();
            let turned = turned_normals(&planes, symmetry);
            let turned = Vec::<f32>::try_from(seen(&turned).flatten(0, -1)).unwrap();
            for at in 0..16 {
                let source = symmetry.source(extent, at % 4, at / 4);
                assert_eq!(found[at], values[source]);
                for axis in 0..3 {
                    let (from, sign) = symmetry.component(axis);
                    assert_eq!(turned[16 * axis + at], sign * values[16 * from + source]);
                }
            }
        }
    }
}
