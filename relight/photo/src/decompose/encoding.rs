//! The decomposing network's input, and the meaning of its output: the same for training
//! and for use.

use crate::nets::{INPUTS, OUTPUTS};
use relight_core::image::{Extent, Planes};
use relight_core::light::Normals;
use relit_data::statistics::above_part;

/// Part of the pixels that are darker than the encoded picture's white.
const WHITE_PERCENTILE: f64 = 0.99;
/// Encoded light is cut off here, in whites.
pub const MAX_LIGHT: f32 = 1.5;
/// Keeps the logarithm of black finite.
pub const LOG_FLOOR: f32 = 0.01;
/// Range of the predicted logarithm of shading.
pub const LOG_SHADING: (f32, f32) = (-6.0, 3.0);
/// Least part of a normal along the line of sight, before its length is made 1.
pub const MIN_FACING: f32 = 0.02;
/// By how much an answer of 0 stands for a small highlight.
pub const HIGHLIGHT_OFFSET: f32 = 3.5;

/// A picture as the network sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct NetworkInput {
    extent: Extent,
    values: Vec<f32>,
    white: f32,
}

/// What the network predicts for a picture, 0 outside its mask.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictedMaps {
    /// Unit normals.
    pub normals: Normals,
    /// Linear albedo, 0..1, right up to a factor.
    pub albedo: Planes<3>,
    /// Shading, grey, right up to a factor.
    pub shading: Planes<1>,
    /// Highlight, grey, in the picture's units.
    pub highlight: Planes<1>,
}

impl NetworkInput {
    /// Encodes a linear picture under a mask (0..=1, in the object from one half). NaN
    /// counts as black.
    ///
    /// # Panics
    /// Where the mask has another size.
    pub fn new(picture: &Planes<3>, mask: &Planes<1>) -> Self {
        assert_eq!(picture.extent(), mask.extent(), "size of the mask");
        let [red, green, blue] = picture.planes();
        let inside: Vec<bool> = mask.plane(0).iter().map(|&m| m >= 0.5).collect();
        let white = white(picture, &inside);
        let pixels = inside.len();
        let mut values = vec![0.0; INPUTS * pixels];
        for at in (0..pixels).filter(|&at| inside[at]) {
            let light = [red[at], green[at], blue[at]].map(|v| (v / white).clamp(0.0, MAX_LIGHT));
            let encoded = encode_pixel(light.map(|v| if v.is_nan() { 0.0 } else { v }));
            for (channel, value) in encoded.into_iter().enumerate() {
                values[channel * pixels + at] = value;
            }
        }
        Self {
            extent: picture.extent(),
            values,
            white,
        }
    }

    /// Width and height.
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// [`INPUTS`] planes, one after the other, row by row.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The light in the picture that counts as 1: below it lie 99 of 100 pixels.
    pub fn white(&self) -> f32 {
        self.white
    }

    /// What an answer of the network to this picture, [`OUTPUTS`] planes, means.
    ///
    /// # Panics
    /// Where the answer has another size.
    pub fn decode(&self, answer: &[f32]) -> PredictedMaps {
        let (extent, pixels) = (self.extent, self.extent.pixels());
        assert_eq!(answer.len(), OUTPUTS * pixels, "size of the answer");
        let (mut normals, mut albedo) = (Planes::zeros(extent), Planes::zeros(extent));
        let (mut shading, mut highlight) = (Planes::zeros(extent), Planes::zeros(extent));
        for at in (0..pixels).filter(|&at| self.values[MASK * pixels + at] > 0.5) {
            let of = |channel: usize| answer[channel * pixels + at];
            let (x, y) = (at % extent.width, at / extent.width);
            normals.set_pixel(x, y, normal([of(0), of(1), of(2)]));
            albedo.set_pixel(x, y, [of(3), of(4), of(5)].map(sigmoid));
            let light = self.white * softplus(of(6) - HIGHLIGHT_OFFSET);
            highlight.set_pixel(x, y, [light]);
            let log_luminance = 2.0 * self.values[LOG_LUMINANCE * pixels + at] - 2.0;
            let log = of(7) + sigmoid(of(8)) * log_luminance;
            shading.set_pixel(x, y, [log.clamp(LOG_SHADING.0, LOG_SHADING.1).exp()]);
        }
        PredictedMaps {
            normals: Normals::new(normals),
            albedo,
            shading,
            highlight,
        }
    }
}

/// The channel of the input that is the mask.
pub const MASK: usize = 3;
/// The channel of the input that is the logarithm of luminance, `(ln + 2) / 2`.
pub const LOG_LUMINANCE: usize = 4;

/// The channels of a pixel inside the mask: the encoded colour about 0, the mask, the logarithm of
/// luminance, and how red and green differ from grey.
fn encode_pixel(light: [f32; 3]) -> [f32; INPUTS] {
    let [red, green, blue] = light.map(|v| 2.0 * v.powf(1.0 / 2.2) - 1.0);
    let sum: f32 = light.iter().sum();
    let log = (sum / 3.0 + LOG_FLOOR).ln();
    let chroma = |v: f32| 4.0 * (v - sum / 3.0) / (sum + 0.03);
    let log_luminance = (log + 2.0) / 2.0;
    let [of_red, of_green] = [light[0], light[1]].map(chroma);
    [red, green, blue, 1.0, log_luminance, of_red, of_green]
}

/// The light below which 99 of 100 pixels' brightest channels lie.
fn white(picture: &Planes<3>, inside: &[bool]) -> f32 {
    let pixels = picture.brightest().zip(inside);
    let values =
        pixels.filter_map(|(value, &inside)| (inside && value.is_finite()).then_some(value));
    above_part(values, WHITE_PERCENTILE).map_or(1.0, |white| white.max(1e-6))
}

fn normal([x, y, z]: [f32; 3]) -> [f32; 3] {
    let z = softplus(z) + MIN_FACING;
    let length = (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|v| v / length)
}

fn sigmoid(value: f32) -> f32 {
    1.0 / (1.0 + (-value).exp())
}

fn softplus(value: f32) -> f32 {
    value.max(0.0) + (-value.abs()).exp().ln_1p()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp() -> Planes<3> {
        Planes::from_fn(Extent::new(20, 10), |x, y| {
            let light = (x + 20 * y) as f32 / 100.0;
            [light, light * 0.5, light * 0.25]
        })
    }

    #[test]
    fn what_lies_outside_the_mask_is_zero_in_and_out() {
        let mask = Planes::from_fn(Extent::new(20, 10), |x, _| [if x < 7 { 1.0 } else { 0.0 }]);
        let encoded = NetworkInput::new(&ramp(), &mask);
        let maps = encoded.decode(&vec![0.3; OUTPUTS * 200]);
        for y in 0..10 {
            for x in 7..20 {
                assert_eq!(maps.shading.pixel(x, y), [0.0]);
                assert_eq!(maps.albedo.pixel(x, y), [0.0; 3]);
                assert!((0..INPUTS).all(|c| encoded.values()[c * 200 + y * 20 + x] == 0.0));
            }
        }
    }

    #[test]
    fn a_brighter_picture_is_encoded_alike() {
        let mask = Planes::filled(Extent::new(20, 10), [1.0]);
        let plain = NetworkInput::new(&ramp(), &mask);
        let brighter = NetworkInput::new(&ramp().map(|v| 8.0 * v), &mask);
        assert!((brighter.white() / plain.white() - 8.0).abs() < 1e-5);
        let pairs = plain.values().iter().zip(brighter.values());
        assert!(pairs.clone().all(|(a, b)| (a - b).abs() < 1e-5));
    }

    #[test]
    fn a_share_of_one_and_no_offset_is_the_picture_itself() {
        let mask = Planes::filled(Extent::new(20, 10), [1.0]);
        let encoded = NetworkInput::new(&ramp(), &mask);
        let mut answer = vec![0.0; OUTPUTS * 200];
        answer[8 * 200..].fill(50.0);
        let shading = encoded.decode(&answer).shading;
        let pixel = ramp().pixel(13, 4);
        let mean = pixel.iter().sum::<f32>() / 3.0 / encoded.white();
        assert!((shading.pixel(13, 4)[0] - mean - LOG_FLOOR).abs() < 1e-4);
    }

    #[test]
    fn numbers_that_are_none_count_as_black() {
        let mut picture = ramp();
        picture.set_pixel(3, 3, [f32::NAN, f32::INFINITY, -2.0]);
        let mask = Planes::filled(Extent::new(20, 10), [1.0]);
        let encoded = NetworkInput::new(&picture, &mask);
        assert!(encoded.values().iter().all(|v| v.is_finite()));
    }
}
