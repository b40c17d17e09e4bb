//! The network of whole turns: normals from the harmonics of every pixel's curve over the table's angle.
//!
//! Input, [`TURN_INPUTS`] channels: what `relight_turn` makes of the curves (`relight_turn::NetworkInput`). Output
//! `normals`, [`TURN_OUTPUTS`] channels: the normal in the viewer's frame before its length is made 1 (3), and the
//! logarithm of the expected length of the chord to the true one (1).

use super::graph::{Graph, Value};

/// Channels of the input.
pub const TURN_INPUTS: usize = 65;
/// Channels of the output.
pub const TURN_OUTPUTS: usize = 4;

/// Channels that every pixel has of its own.
const STEM: usize = 24;
/// Side of the blocks in which pixels enter and leave.
const BLOCK: usize = 2;
/// Channels of the encoder's steps.
const ENCODER: [usize; 4] = [40, 72, 128, 176];
/// Channels that come back to a pixel.
const FINE: usize = 16;
/// Channels in a group of a normalisation.
const GROUP: usize = 8;

/// The network; width and height of its input are multiples of 16.
#[must_use]
pub fn turn_network() -> Graph {
    let (mut net, input) = Graph::new("turn-net", TURN_INPUTS);
    let stem = net.pointwise("stem".to_owned(), input, STEM);
    let stem = net.relu(stem);
    let mut value = net.pixel_unshuffle(stem, BLOCK);
    let mut skips = Vec::new();
    for (step, &outputs) in ENCODER.iter().enumerate() {
        let stride = if step == 0 { 1 } else { 2 };
        value = layer(&mut net, &format!("encoder.{step}"), value, outputs, stride);
        if step > 0 {
            value = residual(&mut net, &format!("encoder.{step}.residual"), value);
        }
        skips.push(value);
    }
    value = residual(&mut net, "middle", value);
    for (step, &skip) in skips.iter().enumerate().rev().skip(1) {
        value = net.upsample(value, false);
        value = net.concatenate(value, skip);
        value = layer(
            &mut net,
            &format!("decoder.{step}"),
            value,
            ENCODER[step],
            1,
        );
    }
    value = net.convolution("fine".to_owned(), value, FINE * BLOCK * BLOCK, 1);
    value = net.pixel_shuffle(value, BLOCK);
    value = net.concatenate(value, stem);
    value = net.convolution("head.0".to_owned(), value, STEM, 1);
    value = net.relu(value);
    value = net.convolution("head.1".to_owned(), value, TURN_OUTPUTS, 1);
    net.output("normals", value);
    net
}

/// Convolution, normalisation of groups, ReLU.
fn layer(net: &mut Graph, name: &str, of: Value, outputs: usize, stride: usize) -> Value {
    let value = net.convolution(format!("{name}.conv"), of, outputs, stride);
    let value = net.group_norm(format!("{name}.norm"), value, GROUP);
    net.relu(value)
}

/// Two layers whose result is added to what went in.
fn residual(net: &mut Graph, name: &str, of: Value) -> Value {
    let channels = net.node(of).channels;
    let value = layer(net, &format!("{name}.0"), of, channels, 1);
    let value = net.convolution(format!("{name}.1.conv"), value, channels, 1);
    let value = net.group_norm(format!("{name}.1.norm"), value, GROUP);
    let sum = net.add(of, value);
    net.relu(sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_answers_as_many_pixels_as_it_is_given_and_is_small() {
        let net = turn_network();
        let normals = net.node(net.outputs()[0].value);
        assert_eq!((normals.channels, normals.scale), (TURN_OUTPUTS, Some(1)));
        assert_eq!(net.multiple(), 16);
        let count: usize = net.parameters().iter().map(|p| p.count()).sum();
        assert!(2 * count < 6_000_000, "{count}");
    }
}
