//! A camera: exposure, white balance, noise, clipping, response and JPEG. Knows lists of linear
//! colours and pictures; nothing of objects or light.

use glam::Vec3;
use image::codecs::jpeg::JpegEncoder;
use image::{ImageFormat, RgbImage};
use serde::{Deserialize, Serialize};

use crate::random::{Random, mix, normal_of};
use relight_core::image::{ColourSpace, Srgb};
use relit_data::statistics::ranked;

/// How a camera turns light into 8-bit values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct CameraModel {
    /// By which all light is multiplied, white balance and exposure: after it, 1 is clipped.
    pub gain: Vec3,
    /// From light to values.
    pub response: Response,
    /// Standard deviation of the noise that does not depend on light, as a part of the clipping level.
    pub read_noise: f32,
    /// Standard deviation of shot noise at the clipping level; it falls with the light's root.
    pub shot_noise: f32,
    /// Quality of the JPEG compression, 1..=100; `None` without compression.
    pub jpeg: Option<u8>,
}

/// How a value, 0..=1, follows from light, 0..=1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Response {
    /// The transfer function of sRGB.
    Srgb,
    /// The power `1 / gamma`.
    Power {
        /// 1.8 to 2.4 in cameras.
        gamma: f32,
    },
}

impl Response {
    /// The value for a light; both are clipped to 0..=1.
    pub(crate) fn encode(self, light: f32) -> f32 {
        let light = light.clamp(0.0, 1.0);
        match self {
            Self::Srgb => Srgb::from_linear(light),
            Self::Power { gamma } => light.powf(1.0 / gamma),
        }
    }

    /// The light, 0..=1, for a value; both are clipped to 0..=1.
    pub(crate) fn decode(self, value: f32) -> f32 {
        let value = value.clamp(0.0, 1.0);
        match self {
            Self::Srgb => Srgb::to_linear(value),
            Self::Power { gamma } => value.powf(gamma),
        }
    }
}

impl CameraModel {
    /// Neither noise nor compression; sRGB.
    pub(crate) fn plain() -> Self {
        Self {
            gain: Vec3::ONE,
            response: Response::Srgb,
            read_noise: 0.0,
            shot_noise: 0.0,
            jpeg: None,
        }
    }

    /// A random camera, without its exposure.
    pub(crate) fn draw(random: &mut Random) -> Self {
        let balance = Vec3::from_array([(); 3].map(|()| (random.normal() * 0.08).exp()));
        let is_noisy = random.chance(0.6);
        let mut noise = |most: f32| {
            if is_noisy {
                random.uniform(0.0..most)
            } else {
                0.0
            }
        };
        let (read_noise, shot_noise) = (noise(0.002), noise(0.006));
        Self {
            gain: balance * 3.0 / balance.element_sum(),
            response: if random.chance(0.4) {
                Response::Srgb
            } else {
                Response::Power {
                    gamma: random.uniform(1.8..2.4),
                }
            },
            read_noise,
            shot_noise,
            jpeg: random.chance(0.4).then(|| random.count(75..98) as u8),
        }
    }

    /// The same camera, exposed so that of these colours the brightest channel of 99 in 100 pixels lies
    /// below `level`. Of black ones it keeps its exposure.
    pub(crate) fn exposed(mut self, image: &[Vec3], level: f32) -> Self {
        let brightest = |colour: &Vec3| (*colour * self.gain).max_element();
        let mut levels: Vec<f32> = image.iter().map(brightest).collect();
        let place = levels.len() * 99 / 100;
        let Some(found) = ranked(&mut levels, place) else {
            return self;
        };
        if found > 1e-9 {
            self.gain *= level / found;
        }
        self
    }

    /// The same camera, exposed longer, at most `longest` times, so that `part` of the pixels of one of
    /// these pictures clip in all channels, and of no other more.
    pub(crate) fn clipping(mut self, pictures: &[Vec<Vec3>], part: f32, longest: f32) -> Self {
        let level = |picture: &Vec<Vec3>| {
            let mut levels: Vec<f32> = picture
                .iter()
                .map(|colour| (*colour * self.gain).min_element())
                .collect();
            let place = (levels.len() as f32 * (1.0 - part)) as usize;
            ranked(&mut levels, place)
        };
        let brightest = pictures.iter().filter_map(level).fold(0.0, f32::max);
        if brightest > 1e-9 {
            self.gain *= (1.0 / brightest).clamp(1.0, longest);
        }
        self
    }

    /// The values that the camera gives for light that already has its gain, with its noise. One value
    /// a channel for each colour; `seed` draws the noise.
    pub(crate) fn values(&self, image: &[Vec3], seed: u64) -> Vec<[u8; 3]> {
        let table = response_table(self.response);
        let encoded = |light: f32| {
            let root = light.clamp(0.0, 1.0).sqrt();
            table[(root * (ENTRIES - 1) as f32 + 0.5) as usize]
        };
        let is_noisy = self.read_noise > 0.0 || self.shot_noise > 0.0;
        let value = |(pixel, colour): (usize, &Vec3)| {
            let mut channels = colour.to_array();
            if is_noisy {
                for (channel, light) in channels.iter_mut().enumerate() {
                    let deviation = self.read_noise + self.shot_noise * light.max(0.0).sqrt();
                    *light += deviation * normal_of(mix(seed ^ (3 * pixel + channel) as u64));
                }
            }
            channels.map(encoded)
        };
        image.iter().enumerate().map(value).collect()
    }

    /// The picture after its compression, if it is compressed.
    pub(crate) fn compressed(&self, picture: RgbImage) -> RgbImage {
        let Some(quality) = self.jpeg else {
            return picture;
        };
        let mut bytes = Vec::new();
        let encoded = JpegEncoder::new_with_quality(&mut bytes, quality).encode_image(&picture);
        let decoded =
            encoded.and_then(|()| image::load_from_memory_with_format(&bytes, ImageFormat::Jpeg));
        // What the encoder writes the decoder reads; if ever not, the picture stays uncompressed.
        decoded.map_or(picture, |decoded| decoded.into_rgb8())
    }
}

/// Entries of a response's table.
const ENTRIES: usize = 1 << 12;

/// The values of a response for many pixels: by the root of light, in which every response is smooth enough.
fn response_table(response: Response) -> Vec<u8> {
    let value = |entry: usize| {
        let root = entry as f32 / (ENTRIES - 1) as f32;
        (response.encode(root * root) * 255.0).round() as u8
    };
    (0..ENTRIES).map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_those_of_the_response() {
        let greys: Vec<Vec3> = (0..=1000).map(|k| Vec3::splat(k as f32 / 1000.0)).collect();
        let responses = [
            Response::Srgb,
            Response::Power { gamma: 1.8 },
            Response::Power { gamma: 2.4 },
        ];
        for response in responses {
            let camera = CameraModel {
                response,
                ..CameraModel::plain()
            };
            for (grey, value) in greys.iter().zip(camera.values(&greys, 0)) {
                let exact = response.encode(grey.x) * 255.0;
                assert!(
                    (f32::from(value[0]) - exact).abs() < 0.56,
                    "{exact} {value:?}"
                );
            }
        }
    }

    #[test]
    fn a_value_is_decoded_to_its_light() {
        for response in [Response::Srgb, Response::Power { gamma: 2.1 }] {
            for light in [0.0, 0.001, 0.2, 0.7, 1.0] {
                assert!((response.decode(response.encode(light)) - light).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn light_beyond_the_clipping_level_and_what_is_no_number_stay_in_range() {
        let strange = [Vec3::new(7.0, -3.0, f32::NAN), Vec3::splat(f32::INFINITY)];
        let values = CameraModel::plain().values(&strange, 0);
        assert_eq!(values, [[255, 0, 0], [255; 3]]);
    }

    #[test]
    fn an_exposure_clips_the_wanted_part_of_the_brightest_picture_and_is_never_shorter() {
        let picture = |most: f32| -> Vec<Vec3> {
            (1..=100)
                .map(|k| Vec3::splat(most * k as f32 / 100.0))
                .collect()
        };
        let pictures = [picture(0.3), picture(0.6)];
        let clipped = |camera: CameraModel| {
            let inside = |colour: &&Vec3| (**colour * camera.gain).min_element() >= 0.9999;
            pictures
                .each_ref()
                .map(|all| all.iter().filter(inside).count())
        };
        let camera = CameraModel::plain().clipping(&pictures, 0.1, 3.0);
        assert_eq!(clipped(camera), [0, 10]);
        let camera = CameraModel::plain().clipping(&pictures, 0.1, 1.2);
        assert!((camera.gain - Vec3::splat(1.2)).length() < 1e-6);
        let camera = CameraModel::plain().clipping(&[picture(5.0)], 0.1, 3.0);
        assert_eq!(camera.gain, CameraModel::plain().gain);
    }

    #[test]
    fn the_noise_has_its_deviation_and_no_bias() {
        let camera = CameraModel {
            read_noise: 0.02,
            response: Response::Power { gamma: 1.0 },
            ..CameraModel::plain()
        };
        let values = camera.values(&vec![Vec3::splat(0.5); 20_000], 9);
        let mean = values.iter().map(|v| f32::from(v[0])).sum::<f32>() / 20_000.0;
        let square = values
            .iter()
            .map(|v| (f32::from(v[0]) - mean).powi(2))
            .sum::<f32>();
        assert!((mean - 127.5).abs() < 0.2, "{mean}");
        assert!(((square / 20_000.0).sqrt() - 5.1).abs() < 0.15);
        assert_ne!(values, camera.values(&vec![Vec3::splat(0.5); 20_000], 10));
    }

    #[test]
    fn the_exposure_puts_the_bright_pixels_where_it_was_told() {
        let image: Vec<Vec3> = (0..1000).map(|k| Vec3::splat(k as f32)).collect();
        let camera = CameraModel::draw(&mut Random::new(4)).exposed(&image, 0.8);
        let above = image
            .iter()
            .filter(|c| (**c * camera.gain).max_element() > 0.8);
        assert_eq!(above.count(), 9);
        assert_eq!(camera.clone().exposed(&[], 0.8), camera);
    }
}
