//! A small U-Net, on the processor: an encoder and a decoder with connections between layers of the same size
//! (Ronneberger, Fischer and Brox, "U-Net", 2015), with residual blocks (He et al., "Deep residual learning", 2016) or
//! bottlenecks.

mod layers;

use half::f16;
use safetensors::{Dtype, SafeTensors};

pub(crate) use layers::Planes;
use layers::{Activation, Bottleneck, Convolution, Depthwise, Layer};

/// The encoder halves the planes so many times.
pub(crate) const LEVELS: usize = 5;

/// The layers.
#[derive(Debug)]
pub(crate) struct Network {
    /// For each size of the encoder, from the largest on.
    encoder: Vec<Vec<Layer>>,
    /// For each size of the decoder, from the smallest on.
    decoder: Vec<Vec<Layer>>,
    /// Before the full size is reached.
    narrow: Convolution,
    /// At the full size.
    head: [Convolution; 2],
}

impl Network {
    /// The network of the layers that weights name, as safetensors; none if they cannot be read. Weights are 16-bit
    /// numbers, or integers of 8 bits with a scale for each output channel.
    pub(crate) fn read(weights: &[u8]) -> Option<Self> {
        let tensors = SafeTensors::deserialize(weights).ok()?;
        let numbers = |name: &str| -> Option<Vec<f32>> {
            let tensor = tensors.tensor(name).ok()?;
            let bytes = tensor.data();
            match tensor.dtype() {
                Dtype::F16 => {
                    let halves = bytes.as_chunks::<2>().0.iter();
                    Some(
                        halves
                            .map(|&half| f16::from_le_bytes(half).to_f32())
                            .collect(),
                    )
                }
                Dtype::I8 => Some(
                    bytes
                        .iter()
                        .map(|&byte| f32::from(byte.cast_signed()))
                        .collect(),
                ),
                _ => None,
            }
        };
        let scaled = |name: &str| {
            let mut weights = numbers(&format!("{name}.weight"))?;
            let biases = numbers(&format!("{name}.bias"))?;
            if let Some(scales) = numbers(&format!("{name}.scale")) {
                let each = weights.len() / scales.len().max(1);
                for (weights, scale) in weights.chunks_mut(each.max(1)).zip(scales) {
                    weights.iter_mut().for_each(|weight| *weight *= scale);
                }
            }
            let shape = tensors.tensor(&format!("{name}.weight")).ok()?;
            Some((weights, biases, *shape.shape().last()?))
        };
        let convolution = |name: &str, activation: Activation| {
            let (weights, biases, side) = scaled(name).filter(|of| matches!(of.2, 1 | 3))?;
            Some(Convolution::new(&weights, biases, side, activation))
        };
        let bottleneck = |name: &str| {
            let part = |part: &str| format!("{name}.{part}");
            let project = convolution(&part("project"), Activation::None)?;
            let halving = scaled(&part("halving"));
            let halves = halving.is_some();
            let (weights, biases, side) = halving.or_else(|| scaled(&part("depthwise")))?;
            Some(Bottleneck {
                expand: convolution(&part("expand"), Activation::Relu6),
                depthwise: Depthwise::new(weights, biases, side, halves),
                project,
            })
        };
        // Its kind follows from the names of its parts.
        let layer = |name: &str| {
            if let Some(plain) = convolution(name, Activation::Relu) {
                return Some(Layer::Plain(plain));
            }
            if let Some(bottleneck) = bottleneck(name) {
                return Some(Layer::Bottleneck(bottleneck));
            }
            if let Some(halving) = convolution(&format!("{name}.halving"), Activation::Relu6) {
                return Some(Layer::Halving(halving));
            }
            let first = convolution(&format!("{name}.layers.0"), Activation::Relu)?;
            let second = convolution(&format!("{name}.layers.1"), Activation::None)?;
            Some(Layer::Residual([first, second]))
        };
        // The layers of a size: as many as there are.
        let layers = |part: &str, level: usize| -> Vec<Layer> {
            (0..)
                .map_while(|number| layer(&format!("{part}.{level}.{number}")))
                .collect()
        };
        Some(Self {
            encoder: (0..LEVELS).map(|level| layers("encoder", level)).collect(),
            decoder: (0..LEVELS - 1)
                .map(|level| layers("decoder", level))
                .collect(),
            narrow: convolution("narrow", Activation::Relu)?,
            head: [
                convolution("head.0", Activation::Relu)?,
                convolution("head.1", Activation::None)?,
            ],
        })
    }

    /// The logits for planes whose sides are multiples of 2 to the power of [`LEVELS`].
    pub(crate) fn apply(&self, seen: Planes) -> Planes {
        let through = |planes: Planes, layers: &[Layer]| {
            layers
                .iter()
                .fold(planes, |planes, layer| layer.apply(planes))
        };
        let mut sizes = vec![seen];
        for layers in &self.encoder {
            if let Some(larger) = sizes.last() {
                let planes = match layers.first() {
                    Some(first) if first.halves() => larger.clone(),
                    _ => larger.halved(),
                };
                sizes.push(through(planes, layers));
            }
        }
        let mut planes = sizes.pop().unwrap_or_else(|| Planes::zeros(0, (0, 0)));
        for layers in &self.decoder {
            if let Some(skipped) = sizes.pop() {
                planes = through(planes.doubled().followed_by(&skipped), layers);
            }
        }
        let planes = self.narrow.apply(&planes).doubled();
        let planes = sizes.iter().fold(planes, Planes::followed_by);
        let [first, last] = &self.head;
        last.apply(&first.apply(&planes))
    }
}

/// Values at another size, bilinearly.
pub(crate) fn resized(values: &[f32], from: (usize, usize), to: (usize, usize)) -> Vec<f32> {
    let places = |from: usize, to: usize| -> Vec<(usize, usize, f32)> {
        let place = |at: usize| {
            let place = (at as f32 + 0.5) * from as f32 / to as f32 - 0.5;
            let place = place.clamp(0.0, (from - 1) as f32);
            let low = place as usize;
            (low, (low + 1).min(from - 1), place - low as f32)
        };
        (0..to).map(place).collect()
    };
    let (columns, rows) = (places(from.0, to.0), places(from.1, to.1));
    let mut resized = Vec::with_capacity(to.0 * to.1);
    for (above, below, down) in rows {
        for &(left, right, across) in &columns {
            let mixed = |row: usize| {
                let (left, right) = (values[row * from.0 + left], values[row * from.0 + right]);
                left + across * (right - left)
            };
            let (above, below) = (mixed(above), mixed(below));
            resized.push(above + down * (below - above));
        }
    }
    resized
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_resized_ramp_is_a_ramp() {
        let wide = resized(&[0.0, 1.0, 0.0, 1.0], (2, 2), (4, 2));
        assert_eq!(wide, [0.0, 0.25, 0.75, 1.0, 0.0, 0.25, 0.75, 1.0]);
    }

    #[test]
    fn bytes_that_are_no_weights_are_no_network() {
        assert!(Network::read(b"").is_none());
        assert!(Network::read(&[0xff; 64]).is_none());
    }
}
