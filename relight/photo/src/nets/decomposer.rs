//! Our network, the default of `relight decompose`: shading, albedo, normals and highlight of a
//! picture from one encoder, each by a head of its own.
//!
//! Shading is answered directly and not only through normals and light: light of order 2 on normals
//! holds no cast shadow, no bounce and no fine relief. Normals are a free vector, so that every slope
//! can be expressed.
//!
//! Input, [`INPUTS`] channels: red, green, blue of the linear picture over its 99th percentile, to the
//! power 1 / 2.2; the mask; log luminance; two chroma differences. All are 0 outside the mask.
//! Output `maps`, [`OUTPUTS`] channels: normal (3, before its length is made 1), albedo (3, logit),
//! highlight (1, before softplus), and log shading as two: an offset, and the share of the picture's
//! own log luminance (logit). [`decomposer_with_light`] has one more, `light`, a vector of [`LIGHT_OUTPUTS`] numbers: the
//! coefficients of order 2 of the unblocked grey irradiance from all around, in units of the mean shading.

use super::graph::{Graph, GroupedLayers, Value};
use super::weights::Weights;

/// Channels of the input.
pub const INPUTS: usize = 7;
/// Channels of the maps.
pub const OUTPUTS: usize = 9;

/// Side of the blocks in which pixels enter and leave.
const BLOCK: usize = 2;
/// Channels of the encoder's steps.
const ENCODER: [usize; 5] = [32, 64, 128, 256, 256];
/// Channels in a group of a normalisation.
const LAYERS: GroupedLayers = GroupedLayers { group: 16 };
/// Residual blocks between encoder and decoder.
const MIDDLE: usize = 2;

/// The output of the head for light.
const LIGHT: &str = "light";
/// How the names of its parameters begin.
pub const LIGHT_PARAMETERS: &str = "light.";
/// Numbers of its answer.
pub const LIGHT_OUTPUTS: usize = 9;
/// Numbers between its layers.
const LIGHT_HIDDEN: usize = 128;

/// The network; width and height of its input are multiples of 32.
pub fn decomposer() -> Graph {
    build(false)
}

/// The same network with a head that predicts the light.
pub fn decomposer_with_light() -> Graph {
    build(true)
}

/// The network of these weights: with the head for light, if they have it.
pub fn decomposer_of(weights: &Weights) -> Graph {
    let mut names = weights.iter().map(|(name, _)| name);
    build(names.any(|name| {
        name.trim_start_matches("module.")
            .starts_with(LIGHT_PARAMETERS)
    }))
}

fn build(tells_light: bool) -> Graph {
    let (mut net, input) = Graph::new("decomposer", INPUTS);
    let blocks = net.pixel_unshuffle(input, BLOCK);
    let features = encode(&mut net, blocks);
    let mut value = features[ENCODER.len() - 1];
    for step in 0..MIDDLE {
        value = LAYERS.residual(&mut net, &format!("middle.{step}"), value);
    }
    let middle = value;
    let skips = features.iter().rev();
    let outputs = ENCODER.iter().rev().skip(1);
    for (step, (&outputs, &skip)) in outputs.zip(skips).enumerate() {
        value = net.concatenate(value, skip);
        value = LAYERS.layer(&mut net, &format!("decoder.{step}"), value, outputs, 1);
        value = net.upsample(value, false);
    }
    value = net.concatenate(value, features[0]);
    value = LAYERS.layer(&mut net, "head.0", value, ENCODER[0], 1);
    let maps = net.convolution("head.1".to_owned(), value, OUTPUTS * BLOCK * BLOCK, 1);
    let maps = net.pixel_shuffle(maps, BLOCK);
    net.output("maps", maps);
    if tells_light {
        let light = light(&mut net, middle);
        net.output(LIGHT, light);
    }
    net
}

/// From the coarsest features to the light, independent of their place in the picture.
fn light(net: &mut Graph, middle: Value) -> Value {
    let named = |layer: usize| format!("{LIGHT_PARAMETERS}{layer}");
    let value = net.pointwise(named(0), middle, LIGHT_HIDDEN);
    let value = net.relu(value);
    let (mean, most) = (net.mean_pool(value), net.max_pool(value));
    let value = net.concatenate(mean, most);
    let value = net.linear(named(1), value, LIGHT_HIDDEN);
    let value = net.relu(value);
    net.linear(named(2), value, LIGHT_OUTPUTS)
}

/// The features of each step, the finest first.
fn encode(net: &mut Graph, input: Value) -> Vec<Value> {
    let mut value = input;
    let mut features = Vec::with_capacity(ENCODER.len());
    for (step, &outputs) in ENCODER.iter().enumerate() {
        let stride = if step == 0 { 1 } else { 2 };
        value = LAYERS.layer(net, &format!("encoder.{step}"), value, outputs, stride);
        if step >= 2 {
            value = LAYERS.residual(net, &format!("encoder.{step}.residual"), value);
        }
        features.push(value);
    }
    features
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_tell_whether_their_network_tells_light() {
        let (plain, more) = (decomposer(), decomposer_with_light());
        assert_eq!(plain.outputs().len(), 1);
        let light = more.node(more.outputs()[1].value);
        assert_eq!((light.channels, light.scale), (LIGHT_OUTPUTS, None));
        for graph in [plain, more] {
            assert_eq!(decomposer_of(&Weights::initial(&graph, 1)), graph);
        }
    }

    #[test]
    fn it_answers_as_many_pixels_as_it_is_given_and_fits_in_40_megabytes_at_half_precision() {
        let net = decomposer();
        let maps = net.node(net.outputs()[0].value);
        assert_eq!((maps.channels, maps.scale), (OUTPUTS, Some(1)));
        assert_eq!(net.multiple(), 32);
        let count: usize = net.parameters().iter().map(|p| p.count()).sum();
        assert!(2 * count < 40_000_000, "{count}");
    }
}
