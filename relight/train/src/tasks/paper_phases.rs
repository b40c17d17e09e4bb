//! The phases in which the paper's networks are trained, and the losses of each.
//!
//! | phase | learns | from |
//! | --- | --- | --- |
//! | `spec` | Spec-Net | highlights of synthetic samples; chromaticity of rank one on turns whose frames are saturated |
//! | `normal` | Normal-Net | normals of synthetic samples (the paper's warm-up) |
//! | `light` | Light-Net, from random weights | reflectance of rank one on turns, Normal-Net as it is (first round) |
//! | `joint` | Normal-Net | reflectance of rank one on turns, Light-Net as it is (second round) |
//! | `specular` | the reflectance net | the highlight of Spec-Net, rendered again |
//!
//! On turns alone the low-rank loss pulls networks away from what they know: each phase that has both has a supervised
//! term on synthetic samples.

use tch::Tensor;

use super::decompose::highlight_error;
use super::low_rank::{chromaticity, low_rank_loss};
use super::paper_layers::{
    diffuse_shading, network_input, normals_of_slopes, power_highlight, predicted_gloss,
    predicted_light, to_srgb,
};
use crate::data::sample::TruthBatch;
use crate::data::turn_reader::TurnTensors;
use crate::engine::losses::{Mean, angular, scale_invariant};
use crate::engine::model::Model;
use crate::engine::tensors::over_channels;
use crate::error::TrainError;

/// Least diffuse light, so that its chromaticity exists.
const DARKEST: f64 = 1e-5;
/// Keeps a division by nothing from being one.
const TINY: f64 = 1e-6;

/// Spec-Net's highlight, linear, 3 channels of 0..=1.
///
/// # Errors
/// [`TrainError::Torch`].
pub(crate) fn highlight_of(
    spec: &Model,
    picture: &Tensor,
    mask: &Tensor,
) -> Result<Tensor, TrainError> {
    let output = &spec.forward(&network_input(&to_srgb(picture), mask))?[0];
    let highlight = (output + 1.0) * 0.5;
    Ok(highlight.clamp(0.0, 1.0) * mask)
}

/// Normal-Net's normals, y up. The network itself has y down, as the paper does.
///
/// # Errors
/// [`TrainError::Torch`].
pub(crate) fn normals_of(
    normal: &Model,
    picture: &Tensor,
    mask: &Tensor,
) -> Result<Tensor, TrainError> {
    let slopes = &normal.forward(&network_input(&to_srgb(picture), mask))?[0];
    let (p, q) = (slopes.narrow(1, 0, 1), slopes.narrow(1, 1, 1));
    Ok(normals_of_slopes(&Tensor::cat(&[p, -q], 1), mask))
}

/// Light-Net's coefficients, `frames x 9 x 3`.
///
/// # Errors
/// [`TrainError::Torch`].
pub(crate) fn light_of(
    light: &Model,
    picture: &Tensor,
    mask: &Tensor,
) -> Result<Tensor, TrainError> {
    let output = &light.forward(&network_input(&to_srgb(picture), mask))?[0];
    Ok(predicted_light(output))
}

/// Rows of one turn's frames under their mask, for the low-rank loss: `1 x frames x values`, brought to a mean length of 1
/// so that a dark turn counts as much as a bright one.
fn rows(of: &Tensor, mask: &Tensor) -> Tensor {
    let rows = (of * mask).flatten(1, -1);
    let frames = rows.size()[0] as f64;
    let length = rows.detach().square().sum(None);
    let scale = (&length / frames).clamp_min(TINY).sqrt();
    (&rows / &scale).unsqueeze(0)
}

/// The same, each row brought to the length 1.
pub(crate) fn equal_rows(of: &Tensor, mask: &Tensor) -> Tensor {
    let rows = (of * mask).flatten(1, -1);
    let square = over_channels(&rows.square());
    (&rows / square.clamp_min(TINY).sqrt()).unsqueeze(0)
}

fn low_rank(of: &Tensor, mask: &Tensor) -> Tensor {
    low_rank_loss(&rows(of, mask))
}

/// The frames for which the gate of saturation opens Spec-Net, and their masks; `None` if they are fewer than two.
pub(crate) fn saturated_frames(turns: &TurnTensors) -> Option<(Tensor, Tensor)> {
    let open: Vec<i64> = (0_i64..)
        .zip(&turns.spec_net)
        .filter_map(|(at, &is_open)| is_open.then_some(at))
        .collect();
    if open.len() < 2 {
        return None;
    }
    let index = Tensor::from_slice(&open).to_device(turns.picture.device());
    Some((
        turns.picture.index_select(0, &index),
        turns.mask.index_select(0, &index),
    ))
}

/// The chromaticity that is left of pictures when Spec-Net's highlight is taken off.
///
/// # Errors
/// [`TrainError::Torch`].
pub(crate) fn diffuse_chromaticity(
    spec: &Model,
    picture: &Tensor,
    mask: &Tensor,
) -> Result<Tensor, TrainError> {
    let highlight = highlight_of(spec, picture, mask)?;
    Ok(chromaticity(&(picture - &highlight).clamp(DARKEST, 1.0)))
}

/// Low-rank loss of the chromaticity that Spec-Net's diffuse pictures have; `None` if the gate opens for fewer than
/// two frames.
///
/// # Errors
/// [`TrainError::Torch`].
pub(crate) fn spec_on_turns(
    spec: &Model,
    turns: &TurnTensors,
) -> Result<Option<Tensor>, TrainError> {
    let Some((picture, mask)) = saturated_frames(turns) else {
        return Ok(None);
    };
    let diffuse = diffuse_chromaticity(spec, &picture, &mask)?;
    Ok(Some(low_rank(&diffuse, &mask)))
}

/// Mean error of Spec-Net's highlight on synthetic samples; highlights count more than their absence.
///
/// # Errors
/// [`TrainError::Torch`].
pub(crate) fn spec_on_truth(spec: &Model, batch: &TruthBatch) -> Result<Mean, TrainError> {
    let found = highlight_of(spec, &batch.picture, &batch.mask)?;
    let truth = batch.highlight.clamp(0.0, 1.0);
    let Mean { value, over } = highlight_error(&found, &truth, &batch.mask);
    let value = value * (1.0 / 3.0);
    Ok(Mean { value, over })
}

/// `1 - cos` of Normal-Net's normals on synthetic samples.
///
/// # Errors
/// [`TrainError::Torch`].
pub(crate) fn normal_on_truth(normal: &Model, batch: &TruthBatch) -> Result<Mean, TrainError> {
    let found = normals_of(normal, &diffuse_of_truth(batch), &batch.mask)?;
    Ok(angular(&found, &batch.normals, &batch.mask))
}

/// Scale-invariant error of the shading by Light-Net's light on the true normals of synthetic samples.
///
/// # Errors
/// [`TrainError::Torch`].
pub(crate) fn light_on_truth(light: &Model, batch: &TruthBatch) -> Result<Mean, TrainError> {
    let coefficients = light_of(light, &diffuse_of_truth(batch), &batch.mask)?;
    let value = shading_error(&coefficients, batch);
    let over = Tensor::from_slice(&[batch.mask.size()[0]]);
    Ok(Mean { value, over })
}

/// Scale-invariant error of each channel's shading: of their mean alone, one channel's light could be negative.
fn shading_error(coefficients: &Tensor, batch: &TruthBatch) -> Tensor {
    let shading = diffuse_shading(&batch.normals, coefficients);
    let thrice = |of: &Tensor| of.repeat_interleave_self_int(3, 0, None);
    let (truth, mask) = (thrice(&batch.shading), thrice(&batch.mask));
    scale_invariant(&shading.flatten(0, 1).unsqueeze(1), &truth, &mask)
}

/// Low-rank loss of the reflectance.
///
/// # Errors
/// [`TrainError::Torch`].
pub(crate) fn reflectance_on_turns(
    normal: &Model,
    light: &Model,
    spec: Option<&Model>,
    turns: &TurnTensors,
) -> Result<Tensor, TrainError> {
    let reflectance = reflectance(normal, light, spec, turns)?;
    Ok(low_rank(&reflectance, &turns.mask))
}

/// The reflectance of a turn's frames: their diffuse pictures over the shading of the networks' normals and light. Not
/// clipped, as light that is dark enough would make all of it 1, and its rank one.
///
/// # Errors
/// [`TrainError::Torch`].
pub(crate) fn reflectance(
    normal: &Model,
    light: &Model,
    spec: Option<&Model>,
    turns: &TurnTensors,
) -> Result<Tensor, TrainError> {
    let mask = &turns.mask;
    let diffuse = match spec {
        Some(spec) => without_highlight(turns, &highlight_of(spec, &turns.picture, mask)?),
        None => turns.picture.shallow_clone(),
    };
    let normals = normals_of(normal, &diffuse, mask)?;
    let coefficients = light_of(light, &diffuse, mask)?;
    Ok(&diffuse / diffuse_shading(&normals, &coefficients))
}

/// The pictures without Spec-Net's highlights, where the gate is open for them: what Normal-Net and Light-Net are given.
fn without_highlight(turns: &TurnTensors, highlight: &Tensor) -> Tensor {
    let removed = highlight * gate(turns);
    (&turns.picture - &removed).clamp(0.0, 1.0)
}

/// The same of synthetic samples, whose highlights are known.
pub(crate) fn diffuse_of_truth(batch: &TruthBatch) -> Tensor {
    (&batch.picture - &batch.highlight).clamp(0.0, 1.0)
}

/// 1 for the frames for which the gate of saturation opens Spec-Net, 0 for the others: `frames x 1 x 1 x 1`.
fn gate(turns: &TurnTensors) -> Tensor {
    let open = turns
        .spec_net
        .iter()
        .map(|&is_open| f32::from(u8::from(is_open)));
    let open = Tensor::from_slice(&open.collect::<Vec<_>>());
    open.to_device(turns.picture.device()).view([-1, 1, 1, 1])
}

/// Mean squared difference between Spec-Net's highlight and the one that the predicted reflectance and smoothness
/// render; `None` if the gate opens for no frame.
///
/// # Errors
/// [`TrainError::Torch`].
pub(crate) fn specular_on_turns(
    reflectance: &Model,
    (spec, normal, light): (&Model, &Model, &Model),
    turns: &TurnTensors,
) -> Result<Option<Tensor>, TrainError> {
    if !turns.spec_net.contains(&true) {
        return Ok(None);
    }
    let (picture, mask) = (&turns.picture, &turns.mask);
    let highlight = highlight_of(spec, picture, mask)?;
    let diffuse = without_highlight(turns, &highlight);
    let normals = normals_of(normal, &diffuse, mask)?;
    let coefficients = light_of(light, &diffuse, mask)?;
    let output = &reflectance.forward(&network_input(&to_srgb(picture), mask))?[0];
    let (strength, smoothness) = predicted_gloss(output);
    let rendered =
        power_highlight(&normals, &coefficients, &strength, &smoothness).clamp(0.0, 1.0) * mask;
    let weight = gate(turns) * mask;
    let error = (&rendered - &highlight).square() * &weight;
    let pixels = (weight.sum(None) * 3.0).clamp_min(1.0);
    Ok(Some(error.sum(None) / &pixels))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::ComputePrecision;
    use relight_photo::nets::paper::{light_net, normal_net, spec_net};
    use relight_photo::nets::{Graph, Weights};
    use tch::{Device, Kind};

    const SIDE: i64 = 64;

    fn model(graph: Graph, seed: u64) -> Model {
        let weights = Weights::initial(&graph, seed);
        Model::new(graph, &weights, Device::Cpu, ComputePrecision::Single).unwrap()
    }

    fn frames(picture: Tensor, spec_net: Vec<bool>) -> TurnTensors {
        TurnTensors {
            mask: Tensor::ones([2, 1, SIDE, SIDE], (Kind::Float, Device::Cpu)),
            picture,
            spec_net,
        }
    }

    fn picture() -> Tensor {
        let count = 2 * 3 * SIDE * SIDE;
        let ramp = Tensor::arange(count, (Kind::Float, Device::Cpu));
        (ramp * 0.37)
            .sin()
            .f_mul_scalar(0.3)
            .unwrap()
            .f_add_scalar(0.6)
            .unwrap()
            .view([2, 3, SIDE, SIDE])
    }

    #[test]
    fn normal_net_and_light_net_are_given_the_picture_without_its_highlights() {
        let (normal, light) = (model(normal_net(), 1), model(light_net(), 2));
        let spec = model(spec_net(), 3);
        let turns = frames(picture(), vec![true, false]);
        let found = reflectance(&normal, &light, Some(&spec), &turns).unwrap();
        // The first frame without its highlight, the second as it is: the gate is closed.
        let highlight = highlight_of(&spec, &turns.picture, &turns.mask).unwrap();
        assert!(highlight.max().double_value(&[]) > 0.05);
        let open = Tensor::from_slice(&[1.0_f32, 0.0]).view([2, 1, 1, 1]);
        let diffuse = (&turns.picture - highlight * open).clamp(0.0, 1.0);
        let expected =
            reflectance(&normal, &light, None, &frames(diffuse, vec![false; 2])).unwrap();
        let off = (found - expected).abs().max().double_value(&[]);
        assert!(off < 1e-5, "{off}");
    }

    #[test]
    fn a_turn_has_a_reflectance_of_rank_one_in_linear_light_and_not_in_that_of_files() {
        let place = (Kind::Float, Device::Cpu);
        let (frames, side) = (12, SIDE);
        let across = Tensor::linspace(-0.7, 0.7, side, place);
        let (x, y) = (
            across
                .view([1, 1, 1, side])
                .expand([frames, 1, side, side], false),
            across
                .view([1, 1, side, 1])
                .expand([frames, 1, side, side], false),
        );
        let z = (x.square() + y.square())
            .neg()
            .f_add_scalar(1.0)
            .unwrap()
            .sqrt();
        let normals = Tensor::cat(&[&x, &y, &z], 1);
        // A bright side that goes around, as over a turn.
        let light: Vec<f32> = (0..frames)
            .flat_map(|frame| {
                let (sin, cos) = (frame as f32 / frames as f32 * std::f32::consts::TAU).sin_cos();
                let bands = [
                    0.8,
                    0.2,
                    0.3 * cos,
                    0.3 * sin,
                    0.1 * sin * cos,
                    0.05,
                    0.1,
                    0.05,
                    0.05,
                ];
                bands.into_iter().flat_map(|value| [value; 3])
            })
            .collect();
        let light = Tensor::from_slice(&light).view([frames, 9, 3]);
        let shading = diffuse_shading(&normals, &light);
        let albedo = (x * 7.0)
            .sin()
            .f_mul_scalar(0.25)
            .unwrap()
            .f_add_scalar(0.4)
            .unwrap();
        let picture = (albedo * &shading).clamp(0.0, 1.0);
        let mask = Tensor::ones([frames, 1, side, side], place);
        let residual = |picture: &Tensor| {
            let reflectance = picture / &shading;
            super::super::validation::rank_residual(&reflectance, &mask).unwrap()
        };
        let (linear, file) = (residual(&picture), residual(&to_srgb(&picture)));
        assert!(linear < 1e-6 && file > 0.002, "{linear} {file}");
    }

    /// Two samples of white paper that faces the viewer.
    fn flat_batch() -> TruthBatch {
        let place = (Kind::Float, Device::Cpu);
        let ones = || Tensor::ones([2, 1, SIDE, SIDE], place);
        TruthBatch {
            input: Tensor::zeros([2, 4, SIDE, SIDE], place),
            mask: ones(),
            picture: Tensor::ones([2, 3, SIDE, SIDE], place),
            shading: ones(),
            albedo: Tensor::ones([2, 3, SIDE, SIDE], place),
            normals: Tensor::cat(&[ones() * 0.0, ones() * 0.0, ones()], 1),
            highlight: ones() * 0.0,
            light: Tensor::zeros([2, 9], place),
        }
    }

    #[test]
    fn light_of_a_negative_colour_is_wrong_though_the_mean_of_the_colours_is_right() {
        let place = (Kind::Float, Device::Cpu);
        let across = Tensor::linspace(-0.7, 0.7, SIDE, place);
        let x = across
            .view([1, 1, 1, SIDE])
            .expand([2, 1, SIDE, SIDE], true)
            .copy();
        let depth = (x.square() * -1.0 + 1.0).sqrt();
        let normals = Tensor::cat(&[&x, &(&x * 0.0), &depth], 1);
        let light = |colour: [f32; 3]| {
            let bands = Tensor::from_slice(&[1.0_f32, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0]);
            let one = bands.view([1, 9, 1]) * Tensor::from_slice(&colour).view([1, 1, 3]);
            one.expand([2, 9, 3], true).copy()
        };
        let white = light([1.0; 3]);
        let shading = diffuse_shading(&normals, &white);
        let batch = TruthBatch {
            shading: shading.narrow(1, 0, 1),
            normals,
            ..flat_batch()
        };
        let error = |light: &Tensor| shading_error(light, &batch).double_value(&[]);
        let (right, wrong) = (error(&white), error(&light([5.0, -1.0, -1.0])));
        assert!(right < 1e-6 && wrong > 0.01, "{right} {wrong}");
    }

    #[test]
    fn composed_samples_teach_normals_of_the_picture_without_its_highlights() {
        let normal = model(normal_net(), 1);
        let ones = || Tensor::ones([2, 1, SIDE, SIDE], (Kind::Float, Device::Cpu));
        let batch = |picture: Tensor, highlight: Tensor| TruthBatch {
            picture,
            highlight,
            ..flat_batch()
        };
        let loss = |batch: &TruthBatch| {
            let loss = normal_on_truth(&normal, batch).unwrap();
            loss.value.double_value(&[])
        };
        let highlight = picture().narrow(1, 0, 1) * 0.3;
        let shining = loss(&batch(picture() * 0.5 + &highlight, highlight.copy()));
        let plain = loss(&batch(picture() * 0.5, ones() * 0.0));
        assert!((shining - plain).abs() < 1e-4, "{shining} {plain}");
    }
}
