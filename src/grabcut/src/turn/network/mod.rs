//! A small network that says of each pixel of a turn whether it shows the object, the table or the room.
//!
//! It sees what the frames show at each pixel over the whole turn ([`observations`]), with at most 320 pixels on the longer
//! side. An encoder and a decoder with connections between layers of the same size (Ronneberger, Fischer and Brox, "U-Net",
//! 2015), and residual blocks (He et al., "Deep residual learning", 2016), have learned from rendered turns;
//! `docs/methods/masking.md` says from which.

mod layers;
mod observations;

use half::f16;
use image::RgbImage;
use image::imageops::thumbnail;
use safetensors::SafeTensors;

use layers::{Convolution, Layer, Planes};
use observations::observe;

/// Frames are reduced to at most so many pixels on their longer side.
const SIDE: u32 = 320;
/// The encoder halves the planes so many times.
const LEVELS: usize = 5;
/// Classes of a pixel: object, table, room.
const CLASSES: usize = 3;
const OBJECT: usize = 0;
const TABLE: usize = 1;
/// The weights of the layers, 16-bit numbers.
const WEIGHTS: &[u8] = include_bytes!("weights.safetensors");

/// The layers.
#[derive(Debug)]
struct Network {
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
    /// The network that is part of the program, of the layers that its weights name; none if they cannot be read.
    fn shipped() -> Option<Self> {
        let tensors = SafeTensors::deserialize(WEIGHTS).ok()?;
        let numbers = |name: &str| {
            let tensor = tensors.tensor(name).ok()?;
            let halves = tensor.data().as_chunks::<2>().0.iter();
            Some(
                halves
                    .map(|&bytes| f16::from_le_bytes(bytes).to_f32())
                    .collect::<Vec<f32>>(),
            )
        };
        let layer = |name: &str, is_rectified: bool| {
            let weights = numbers(&format!("{name}.weight"))?;
            let biases = numbers(&format!("{name}.bias"))?;
            Some(Convolution::new(&weights, biases, is_rectified))
        };
        let plain_or_residual = |name: &str| {
            if let Some(plain) = layer(name, true) {
                return Some(Layer::Plain(plain));
            }
            let first = layer(&format!("{name}.layers.0"), true)?;
            let second = layer(&format!("{name}.layers.1"), false)?;
            Some(Layer::Residual([first, second]))
        };
        // The layers of a size: as many as there are.
        let layers = |part: &str, level: usize| -> Vec<Layer> {
            (0..)
                .map_while(|number| plain_or_residual(&format!("{part}.{level}.{number}")))
                .collect()
        };
        Some(Self {
            encoder: (0..LEVELS).map(|level| layers("encoder", level)).collect(),
            decoder: (0..LEVELS - 1)
                .map(|level| layers("decoder", level))
                .collect(),
            narrow: layer("narrow", true)?,
            head: [layer("head.0", true)?, layer("head.1", false)?],
        })
    }

    /// The classes' logits for observations whose sides are multiples of 2 to the power of [`LEVELS`].
    fn apply(&self, seen: Planes) -> Planes {
        let through = |planes: Planes, layers: &[Layer]| {
            layers
                .iter()
                .fold(planes, |planes, layer| layer.apply(planes))
        };
        let mut sizes = vec![seen];
        for layers in &self.encoder {
            if let Some(larger) = sizes.last() {
                sizes.push(through(larger.halved(), layers));
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

/// What the network says of a turn.
#[derive(Debug)]
pub(crate) struct Classes {
    size: (usize, usize),
    /// The logarithms of the odds that a pixel shows the object.
    object: Vec<f32>,
    /// The same of the table.
    table: Vec<f32>,
}

impl Classes {
    /// Of frames of one size, spread evenly over the turn; none if they show no object.
    pub(crate) fn from_frames(frames: &[RgbImage]) -> Option<Self> {
        let network = Network::shipped()?;
        let (width, height) = frames.first()?.dimensions();
        if width == 0 || height == 0 {
            return None;
        }
        let scale = f64::from(SIDE) / f64::from(width.max(height));
        let small = |side: u32| ((f64::from(side) * scale).round() as u32).max(1);
        let reduced: Vec<RgbImage> = if scale < 1.0 {
            let each = frames.iter();
            each.map(|frame| thumbnail(frame, small(width), small(height)))
                .collect()
        } else {
            frames.to_vec()
        };
        let (width, height) = reduced.first()?.dimensions();
        let (width, height) = (width as usize, height as usize);
        let logits = network.apply(observe(&reduced, 1 << LEVELS));
        if logits.channels() != CLASSES {
            return None;
        }
        let logits = &logits;
        let logits_at = move |at: usize| {
            let at = at / width * logits.width + at % width;
            std::array::from_fn(|class| logits.values[class * logits.area() + at])
        };
        let odds =
            |class: usize| (0..width * height).map(move |at| log_odds(&logits_at(at), class));
        let object: Vec<f32> = odds(OBJECT).collect();
        let table = odds(TABLE).collect();
        object.iter().any(|&odds| odds > 0.0).then_some(Self {
            size: (width, height),
            object,
            table,
        })
    }

    /// The logarithms of the odds of the object at another size.
    pub(crate) fn object(&self, size: (usize, usize)) -> Vec<f32> {
        resized(&self.object, self.size, size)
    }

    /// The same of the table.
    pub(crate) fn table(&self, size: (usize, usize)) -> Vec<f32> {
        resized(&self.table, self.size, size)
    }
}

/// The logarithm of the odds of a class against the other two.
fn log_odds(logits: &[f32; CLASSES], class: usize) -> f32 {
    let (one, two) = (logits[(class + 1) % CLASSES], logits[(class + 2) % CLASSES]);
    let most = one.max(two);
    logits[class] - most - ((one - most).exp() + (two - most).exp()).ln()
}

/// Values at another size, bilinearly.
fn resized(values: &[f32], from: (usize, usize), to: (usize, usize)) -> Vec<f32> {
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
    use image::Rgb;

    /// Where observations and logits are compared: column and row.
    const PLACES: [(usize, usize); 3] = [(7, 5), (50, 33), (95, 71)];

    /// Frames of a pattern that moves.
    fn frames() -> Vec<RgbImage> {
        let frame = |turn: u32| {
            RgbImage::from_fn(96, 72, |x, y| {
                let level = |channel: u32| {
                    let moved = turn * (x / 8 + 1) * (11 + channel);
                    ((3 * x + y * (5 + channel) + moved + x * y / 7) % 256) as u8
                };
                Rgb([level(0), level(1), level(2)])
            })
        };
        (0..8).map(frame).collect()
    }

    fn at_places(planes: &Planes, channel: usize) -> [f32; 3] {
        let begin = channel * planes.area();
        PLACES.map(|(x, y)| planes.values[begin + y * planes.width + x])
    }

    /// The numbers are those of `tests/bench/turn_network.py parity`.
    #[test]
    fn observations_and_logits_are_those_of_the_training() {
        let seen = observe(&frames(), 1 << LEVELS);
        assert_eq!((seen.width, seen.height), (96, 96));
        let logits = Network::shipped().unwrap().apply(seen.clone());
        let near = |found: [f32; 3], wanted: [f32; 3], by: f32| {
            let pairs = found.iter().zip(wanted);
            pairs.fold(0.0, |most: f32, (found, wanted)| {
                most.max((found - wanted).abs())
            }) < by
        };
        for (plane, wanted) in OBSERVED {
            let found = at_places(&seen, plane);
            assert!(near(found, wanted, 1e-4), "{plane}: {found:?}");
        }
        for (class, wanted) in LOGITS.into_iter().enumerate() {
            let found = at_places(&logits, class);
            assert!(near(found, wanted, 0.02), "{class}: {found:?}");
        }
    }

    const OBSERVED: [(usize, [f32; 3]); 7] = [
        (0, [0.350_98, 0.452_94, 0.568_63]),
        (6, [0.205_03, 1.001_11, 1.053_67]),
        (8, [-0.320_12, -0.019_97, -0.163_88]),
        (11, [0.540_77, 0.667_95, 0.463_93]),
        (12, [0.169_66, 0.565_49, 0.311_53]),
        (14, [1.0, 0.794_80, 0.0]),
        (17, [0.274_61, 0.658_76, 0.0]),
    ];
    const LOGITS: [[f32; 3]; 3] = [
        [1.869_19, -5.349_46, -5.066_55],
        [-2.717_02, -7.302_54, 0.720_20],
        [-0.320_81, 5.529_08, 0.981_57],
    ];

    #[test]
    fn odds_of_equal_logits_are_one_to_two_and_a_resized_ramp_is_a_ramp() {
        assert!((log_odds(&[1.0; 3], OBJECT) + 2.0_f32.ln()).abs() < 1e-6);
        let wide = resized(&[0.0, 1.0, 0.0, 1.0], (2, 2), (4, 2));
        assert_eq!(wide, [0.0, 0.25, 0.75, 1.0, 0.0, 0.25, 0.75, 1.0]);
    }

    #[test]
    fn without_an_object_the_network_says_nothing() {
        assert!(Classes::from_frames(&[]).is_none());
        assert!(Classes::from_frames(&[RgbImage::new(0, 0)]).is_none());
        assert!(Classes::from_frames(&vec![RgbImage::new(1, 1); 4]).is_none());
        assert!(Classes::from_frames(&vec![RgbImage::new(330, 33); 4]).is_none());
    }
}
