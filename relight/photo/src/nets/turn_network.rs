//! The network of whole turns: normals and albedo from the harmonics of every pixel's curve over the table's angle.
//!
//! Input, [`TURN_INPUTS`] channels: what `relight_turn` makes of the curves (`relight_turn::network_input`). Output
//! `normals`, [`TURN_OUTPUTS`] channels: the normal in the viewer's frame before its length is made 1 (3), and the
//! logarithm of the expected length of the chord to the true one (1). Output `albedo`, [`ALBEDO_OUTPUTS`] channels: the
//! logarithm of albedo over the mean of the curve, each channel in any unit.

use super::graph::{Graph, GroupedLayers, Value};

/// Channels of the input.
pub const TURN_INPUTS: usize = 65;
/// Channels of the output.
pub const TURN_OUTPUTS: usize = 4;
/// Channels of the output for the albedo.
pub const ALBEDO_OUTPUTS: usize = 3;
/// The first of the three channels of the input that have the logarithms of the curves' means.
pub const LOG_MEANS: usize = 32;

/// Channels that every pixel has of its own.
const STEM: usize = 32;
/// Side of the blocks in which pixels enter and leave.
const BLOCK: usize = 2;
/// Channels of the encoder's steps.
const ENCODER: [usize; 4] = [56, 104, 176, 240];
/// Channels that come back to a pixel.
const FINE: usize = 16;
/// Channels in a group of a normalisation.
const LAYERS: GroupedLayers = GroupedLayers { group: 8 };

/// The network; width and height of its input are multiples of 16.
pub fn turn_network() -> Graph {
    let (mut net, input) = Graph::new("turn-net", TURN_INPUTS);
    let stem = net.pointwise("stem".to_owned(), input, STEM);
    let stem = net.relu(stem);
    let mut value = net.pixel_unshuffle(stem, BLOCK);
    let mut skips = Vec::new();
    for (step, &outputs) in ENCODER.iter().enumerate() {
        let stride = if step == 0 { 1 } else { 2 };
        value = LAYERS.layer(&mut net, &format!("encoder.{step}"), value, outputs, stride);
        if step > 0 {
            value = LAYERS.residual(&mut net, &format!("encoder.{step}.residual"), value);
        }
        skips.push(value);
    }
    value = LAYERS.residual(&mut net, "middle", value);
    for (step, &skip) in skips.iter().enumerate().rev().skip(1) {
        value = net.upsample(value, false);
        value = net.concatenate(value, skip);
        value = LAYERS.layer(
            &mut net,
            &format!("decoder.{step}"),
            value,
            ENCODER[step],
            1,
        );
    }
    let normals = head(
        &mut net,
        ["fine", "head.0", "head.1"],
        value,
        stem,
        TURN_OUTPUTS,
    );
    net.output("normals", normals);
    let names = ["albedo.fine", "albedo.0", "albedo.1"];
    let albedo = head(&mut net, names, value, stem, ALBEDO_OUTPUTS);
    net.output("albedo", albedo);
    net
}

/// The output of the blocks and each pixel's own channels, through three convolutions.
fn head(net: &mut Graph, names: [&str; 3], blocks: Value, stem: Value, outputs: usize) -> Value {
    let [fine, first, last] = names.map(str::to_owned);
    let value = net.convolution(fine, blocks, FINE * BLOCK * BLOCK, 1);
    let value = net.pixel_shuffle(value, BLOCK);
    let value = net.concatenate(value, stem);
    let value = net.convolution(first, value, STEM, 1);
    let value = net.relu(value);
    net.convolution(last, value, outputs, 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_answers_as_many_pixels_as_it_is_given_and_is_small() {
        let net = turn_network();
        let normals = net.node(net.outputs()[0].value);
        assert_eq!((normals.channels, normals.scale), (TURN_OUTPUTS, Some(1)));
        let albedo = net.node(net.outputs()[1].value);
        assert_eq!((albedo.channels, albedo.scale), (ALBEDO_OUTPUTS, Some(1)));
        assert_eq!(net.multiple(), 16);
        let count: usize = net.parameters().iter().map(|p| p.count()).sum();
        assert!(2 * count < 11_000_000, "{count}");
    }
}
