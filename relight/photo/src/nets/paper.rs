//! The paper's networks, with the shapes and the parameter names of its released code.
//!
//! Convolutions are 3 x 3 with padding 1, normalisation is instance normalisation without parameters,
//! upsampling is bilinear with aligned corners.

use super::graph::{Graph, Value};

/// Coefficients and light colour that Light-Net predicts: 9 + 3.
pub const LIGHT_OUTPUTS: usize = 12;
/// What the reflectance net predicts: specular reflectance (red, green, blue) and smoothness.
pub const REFLECTANCE_OUTPUTS: usize = 4;

/// Output channels of the encoder's steps; all but the first halve the picture.
const ENCODER: [usize; 6] = [16, 32, 64, 128, 256, 256];
/// Output channels of the decoder's steps. Each step doubles the picture.
const DECODER: [usize; 5] = [256, 128, 64, 32, 16];
/// Convolutions between encoder and decoder.
const MIDDLE: usize = 4;
/// Width of the hidden layer of the light head.
const HEAD_WIDTH: usize = 256;

/// Spec-Net: the highlight of a picture, before `(tanh + 1) / 2` becomes `[0, 1]`.
///
/// Input: 3 channels, `(x - 0.5) / 0.5` of the sRGB picture times the mask. Output `specular`: 3
/// channels, -1..=1.
pub fn spec_net() -> Graph {
    u_net("spec-net", "specular", 3)
}

/// Normal-Net: the slopes (p, q) of a picture's surface, whose normal is (p, q, 1) over its length.
///
/// Input as [`spec_net`]'s. Output `slopes`: 2 channels, -1..=1, so that no slope beyond 45 degrees
/// a direction can be expressed.
pub fn normal_net() -> Graph {
    u_net("normal-net", "slopes", 2)
}

/// Light-Net: nine coefficients of order-2 spherical harmonics, and the light's colour.
///
/// Its head is not the released one, a layer of 138 million parameters for pictures of 256 x 256 pixels only, but takes mean and
/// maximum over the picture. Input as [`spec_net`]'s. Output `light`: a vector of [`LIGHT_OUTPUTS`].
pub fn light_net() -> Graph {
    numbers_net("light-net", "light", LIGHT_OUTPUTS)
}

/// The net for specular reflectance s_p and smoothness alpha, with Light-Net's structure.
///
/// Input as [`spec_net`]'s. Output `reflectance`: a vector of [`REFLECTANCE_OUTPUTS`].
pub fn reflectance_net() -> Graph {
    numbers_net("reflectance-net", "reflectance", REFLECTANCE_OUTPUTS)
}

fn u_net(name: &'static str, output: &'static str, channels: usize) -> Graph {
    let (mut net, input) = Graph::new(name, 3);
    let features = encode(&mut net, input);
    let mut value = join_middle(&mut net, &features);
    let skips = features.iter().rev().skip(1);
    for (step, (&outputs, &skip)) in DECODER.iter().zip(skips).enumerate() {
        value = block(&mut net, format!("deconv{step}.0"), value, outputs, 1);
        value = net.upsample(value, true);
        value = net.concatenate(value, skip);
    }
    value = block(&mut net, "output.0".to_owned(), value, ENCODER[0], 1);
    value = net.convolution("output.3".to_owned(), value, channels, 1);
    value = net.instance_norm(value);
    value = net.tanh(value);
    net.output(output, value);
    net
}

fn numbers_net(name: &'static str, output: &'static str, numbers: usize) -> Graph {
    let (mut net, input) = Graph::new(name, 3);
    let features = encode(&mut net, input);
    let joined = join_middle(&mut net, &features);
    let mean = net.mean_pool(joined);
    let most = net.max_pool(joined);
    let pooled = net.concatenate(mean, most);
    let hidden = net.linear("head.0".to_owned(), pooled, HEAD_WIDTH);
    let hidden = net.relu(hidden);
    let value = net.linear("head.2".to_owned(), hidden, numbers);
    net.output(output, value);
    net
}

/// The features of each step of the encoder, the finest first.
fn encode(net: &mut Graph, input: Value) -> Vec<Value> {
    let mut value = input;
    let mut features = Vec::with_capacity(ENCODER.len());
    for (step, &outputs) in ENCODER.iter().enumerate() {
        let stride = if step == 0 { 1 } else { 2 };
        value = block(net, format!("conv{step}.0"), value, outputs, stride);
        features.push(value);
    }
    features
}

/// The middle of the network beside the coarsest features.
fn join_middle(net: &mut Graph, features: &[Value]) -> Value {
    let coarsest = features[ENCODER.len() - 1];
    let mut value = coarsest;
    for step in 0..MIDDLE {
        let channels = net.node(coarsest).channels;
        value = block(net, format!("mid.{}", 3 * step), value, channels, 1);
    }
    net.concatenate(value, coarsest)
}

/// Convolution, instance normalisation, ReLU.
fn block(net: &mut Graph, name: String, of: Value, outputs: usize, stride: usize) -> Value {
    let value = net.convolution(name, of, outputs, stride);
    let value = net.instance_norm(value);
    net.relu(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn networks_are_as_large_as_the_papers() {
        let count = |net: Graph| net.parameters().iter().map(|p| p.count()).sum::<usize>();
        assert!(count(light_net()) < 4_500_000);
        assert!((5_200_000..5_500_000).contains(&count(normal_net())));
        assert_eq!(normal_net().multiple(), 32);
    }

    #[test]
    fn parameters_have_the_released_names() {
        let names: Vec<String> = normal_net()
            .parameters()
            .into_iter()
            .map(|p| p.name)
            .collect();
        for name in [
            "conv0.0.weight",
            "mid.9.bias",
            "deconv4.0.weight",
            "output.3.weight",
        ] {
            assert!(names.iter().any(|known| known == name), "{name}");
        }
    }
}
