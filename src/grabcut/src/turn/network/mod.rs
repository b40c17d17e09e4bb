//! A small network that says of each pixel of a turn whether it shows the object, the table or the room.
//!
//! It sees what the frames show at each pixel over the whole turn ([`observations`]), with 160 to 320 pixels on the longer
//! side. Four of the encoder's five sizes began as the first blocks of EfficientNet-lite0 (Tan and Le, 2019), the coarsest
//! has residual blocks (He et al., 2016); the decoder has connections to layers of the same size (Ronneberger, Fischer and
//! Brox, "U-Net", 2015). They have learned from rendered and drawn turns; `docs/methods/masking.md` says from which.

mod observations;

use std::cmp::Ordering;

use image::RgbImage;
use image::imageops::{FilterType, resize, thumbnail};

use crate::unet::{LEVELS, Network, resized};
use observations::observe;

/// Frames are reduced to at most so many pixels on their longer side.
const MAX_SIDE: u32 = 320;
/// Smaller frames are enlarged to so many: the network has hardly seen any.
const MIN_SIDE: u32 = 160;
/// Classes of a pixel: object, table, room.
const CLASSES: usize = 3;
const OBJECT: usize = 0;
const TABLE: usize = 1;
/// The weights of the layers.
const WEIGHTS: &[u8] = include_bytes!("weights.safetensors");

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
        let network = Network::read(WEIGHTS)?;
        let (width, height) = frames.first()?.dimensions();
        if width == 0 || height == 0 {
            return None;
        }
        let reduced: Vec<RgbImage> = frames.iter().map(at_known_size).collect();
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

/// A frame in a size that the network knows.
fn at_known_size(frame: &RgbImage) -> RgbImage {
    let (width, height) = frame.dimensions();
    let longer = width.max(height);
    let wanted = longer.clamp(MIN_SIDE, MAX_SIDE);
    let scale = f64::from(wanted) / f64::from(longer);
    let side = |side: u32| ((f64::from(side) * scale).round() as u32).max(1);
    match wanted.cmp(&longer) {
        Ordering::Less => thumbnail(frame, side(width), side(height)),
        Ordering::Equal => frame.clone(),
        Ordering::Greater => resize(frame, side(width), side(height), FilterType::Triangle),
    }
}

/// The logarithm of the odds of a class against the other two.
fn log_odds(logits: &[f32; CLASSES], class: usize) -> f32 {
    let (one, two) = (logits[(class + 1) % CLASSES], logits[(class + 2) % CLASSES]);
    let most = one.max(two);
    logits[class] - most - ((one - most).exp() + (two - most).exp()).ln()
}

#[cfg(test)]
mod tests {
    use image::Rgb;

    use super::*;
    use crate::unet::Planes;

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
        let logits = Network::read(WEIGHTS).unwrap().apply(seen.clone());
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
        [-4.450_32, -2.159_12, -5.124_57],
        [-0.258_37, -3.608_80, 1.357_03],
        [1.031_06, 3.092_35, 1.127_65],
    ];

    #[test]
    fn odds_of_equal_logits_are_one_to_two() {
        assert!((log_odds(&[1.0; 3], OBJECT) + 2.0_f32.ln()).abs() < 1e-6);
    }

    #[test]
    fn without_an_object_the_network_says_nothing() {
        assert!(Classes::from_frames(&[]).is_none());
        assert!(Classes::from_frames(&[RgbImage::new(0, 0)]).is_none());
        assert!(Classes::from_frames(&vec![RgbImage::new(1, 1); 4]).is_none());
        assert!(Classes::from_frames(&vec![RgbImage::new(330, 33); 4]).is_none());
    }
}
