//! Whether the environment light changes enough over the turn, from a small sample of its frames.

use image::RgbImage;
use relit_data::geometry::Rect;
use relit_data::image_stats::SATURATION_LEVEL;
use relit_data::srgb::to_linear;
use relit_data::statistics::median;
use relit_data::turn_light::modulation;
use relit_video::{LiveDecoder, PixelFormat, StreamFormat, is_key};

/// Blocks across and down the middle of the picture, where the object stands.
const BLOCKS: u32 = 12;
/// Most frames that are kept. When there are more, every other one is forgotten.
const MAX_FRAMES: usize = 64;
/// From one frame that is looked at to the next, at first.
const FIRST_STEP: usize = 8;

/// Looks at a frame now and then, about evenly spread over the turn.
pub(super) struct EnvironmentLight {
    stream: StreamFormat,
    decoder: Option<LiveDecoder>,
    /// Linear light by an 8-bit value.
    linear: [f64; 256],
    /// Frames from one to the next, and which one comes next.
    every: usize,
    next: usize,
    samples: Vec<Sample>,
}

/// A frame of the turn, and the mean light of its blocks: none of those that clip.
struct Sample {
    frame: usize,
    blocks: Vec<Option<f64>>,
}

impl EnvironmentLight {
    pub(super) fn new(stream: StreamFormat) -> Self {
        Self {
            stream,
            decoder: LiveDecoder::new(stream.format, stream.width, stream.height).ok(),
            linear: std::array::from_fn(|value| to_linear(value as f64 / 255.0)),
            every: FIRST_STEP,
            next: 0,
            samples: Vec::new(),
        }
    }

    /// Takes frame `frame` of the turn, from 0. Of frames that build on others only key frames are looked at; one that cannot
    /// be decoded is passed over.
    pub(super) fn add(&mut self, frame: usize, data: &[u8]) {
        let is_alone = self.stream.format != PixelFormat::H264 || is_key(data);
        if frame < self.next || !is_alone {
            return;
        }
        let Some(rgb) = self.decode(data) else {
            return;
        };
        let blocks = self.blocks(&rgb);
        self.samples.push(Sample { frame, blocks });
        self.next = frame + self.every;
        if self.samples.len() >= MAX_FRAMES {
            let mut keep = false;
            self.samples.retain(|_| {
                keep = !keep;
                keep
            });
            self.every *= 2;
        }
    }

    fn decode(&mut self, data: &[u8]) -> Option<RgbImage> {
        let picture = self.decoder.as_mut()?.decode(data).ok()??;
        let (width, height) = picture.size();
        picture.rgb(Rect::middle_of(width, height)).ok()
    }

    fn blocks(&self, rgb: &RgbImage) -> Vec<Option<f64>> {
        let place = |at: u32, size: u32| (at * BLOCKS / size.max(1)).min(BLOCKS - 1);
        let mut sums = vec![(0.0, 0_u32, false); (BLOCKS * BLOCKS) as usize];
        for (x, y, pixel) in rgb.enumerate_pixels() {
            let block = place(y, rgb.height()) * BLOCKS + place(x, rgb.width());
            let (sum, count, clips) = &mut sums[block as usize];
            let light = pixel.0.map(|value| self.linear[usize::from(value)]);
            *sum += light.iter().sum::<f64>() / 3.0;
            *count += 1;
            *clips |= pixel.0.iter().any(|&value| value >= SATURATION_LEVEL);
        }
        let mean = |(sum, count, clips): (f64, u32, bool)| {
            (count > 0 && !clips).then(|| sum / f64::from(count))
        };
        sums.into_iter().map(mean).collect()
    }

    /// The median over the blocks of the [`modulation`] of their light, over a turn of so many frames; none where
    /// too few frames or blocks could be looked at.
    pub(super) fn modulation(&self, frames: usize) -> Option<f64> {
        let of_block = |block: usize| {
            let seen = self.samples.iter().filter_map(|sample| {
                let part = sample.frame as f64 / frames.max(1) as f64;
                sample.blocks[block].map(|light| (part, light))
            });
            let seen: Vec<(f64, f64)> = seen.collect();
            // A block that clips in half of the turn says little of the rest.
            (2 * seen.len() > self.samples.len())
                .then(|| modulation(&seen))
                .flatten()
        };
        median((0..(BLOCKS * BLOCKS) as usize).filter_map(of_block))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const SIDE: u32 = 48;

    fn stream() -> StreamFormat {
        StreamFormat {
            format: PixelFormat::Grey,
            width: SIDE,
            height: SIDE,
            fps: 30.0,
        }
    }

    /// The modulation of a turn in which all of the picture is so bright, by the part of the turn.
    fn of_turn(frames: usize, level: impl Fn(f64) -> f64) -> Option<f64> {
        let mut light = EnvironmentLight::new(stream());
        for frame in 0..frames {
            let value = level(frame as f64 / frames as f64);
            light.add(frame, &vec![value as u8; (SIDE * SIDE) as usize]);
        }
        light.modulation(frames)
    }

    #[test]
    fn a_room_with_a_bright_side_and_an_even_one_are_told_apart() {
        let bright = of_turn(1500, |part| 120.0 + 60.0 * (TAU * part).cos()).unwrap();
        assert!(bright > 0.4, "{bright}");
        let even = of_turn(1500, |part| 120.0 + 2.0 * (TAU * part).cos()).unwrap();
        assert!(even < 0.04, "{even}");
    }

    #[test]
    fn however_long_a_turn_is_a_few_frames_are_kept() {
        let mut light = EnvironmentLight::new(stream());
        for frame in 0..5000 {
            light.add(frame, &[100; (SIDE * SIDE) as usize]);
        }
        assert!((MAX_FRAMES / 2..MAX_FRAMES).contains(&light.samples.len()));
        let steps = light.samples.windows(2);
        assert!(
            steps
                .into_iter()
                .all(|pair| pair[1].frame - pair[0].frame == light.every)
        );
    }

    #[test]
    fn a_picture_that_clips_and_one_that_is_damaged_say_nothing() {
        assert_eq!(of_turn(300, |_| 255.0), None);
        let mut light = EnvironmentLight::new(stream());
        (0..300).for_each(|frame| light.add(frame, &[1, 2, 3]));
        assert_eq!(light.modulation(300), None);
    }
}
