//! The samples of a shard as arrays: `shard_arrays SHARD.tar`.
//!
//! Of each sample it makes what a network takes: the image as `f32`, channel by channel, 0 to 1 in linear light, and
//! the mask as 0 or 1. It prints the mean light of the object.
#![allow(clippy::print_stdout, reason = "the example is a program of its own")]

use std::error::Error;
use std::fs::File;
use std::io::BufReader;

use relit_data::shard::{FrameRecord, ShardReader, decode_mask, decode_rgb};
use relit_data::srgb::to_linear;

/// One sample.
struct Arrays {
    /// 3 x height x width.
    image: Vec<f32>,
    /// height x width.
    mask: Vec<f32>,
    record: FrameRecord,
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args_os().nth(1).ok_or("give a shard")?;
    // Any 12 samples in a row cover the whole turn: no shuffling is needed.
    for sample in ShardReader::new(BufReader::new(File::open(path)?)) {
        let sample = sample?;
        let member = |name: &'static str| sample.member(name).ok_or(name);
        let arrays = arrays(member("png")?, member("mask.png")?, member("json")?)?;
        let pixels = arrays.mask.len();
        let inside: f32 = arrays.mask.iter().sum();
        let mean = |channel: usize| {
            let plane = &arrays.image[channel * pixels..(channel + 1) * pixels];
            plane.iter().sum::<f32>() / inside.max(1.0)
        };
        println!(
            "sample {:4}: {:?} pixels, mean light {:.3} {:.3} {:.3}, Spec-Net {}",
            arrays.record.index,
            arrays.record.size,
            mean(0),
            mean(1),
            mean(2),
            arrays.record.spec_net
        );
    }
    Ok(())
}

/// The image is 0 outside the mask already.
fn arrays(image: &[u8], mask: &[u8], record: &[u8]) -> Result<Arrays, Box<dyn Error>> {
    let image = decode_rgb(image)?;
    let mask = decode_mask(mask)?;
    let light = |value: u8| to_linear(f64::from(value) / 255.0) as f32;
    let plane = |channel: usize| image.pixels().map(move |pixel| light(pixel.0[channel]));
    Ok(Arrays {
        image: (0..3).flat_map(plane).collect(),
        mask: mask
            .pixels()
            .map(|pixel| f32::from(pixel.0[0]) / 255.0)
            .collect(),
        record: serde_json::from_slice(record)?,
    })
}
