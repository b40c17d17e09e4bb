//! Maps of 16 bits a channel.

use glam::Vec3;
use png::{BitDepth, ColorType, Compression, Filter};

use crate::SynthError;
use crate::geometry::GBuffer;

/// Colours as 16-bit values.
pub(crate) struct Rgb16 {
    /// One for each covered pixel.
    values: Vec<[u16; 3]>,
    /// What 65535 stands for.
    pub(crate) white: f32,
}

impl Rgb16 {
    /// Colours of 0..=`white`; others are clipped.
    pub(crate) fn up_to(colours: &[Vec3], white: f32) -> Self {
        let scale = 65_535.0 / white;
        let value = |colour: &Vec3| (*colour * scale).to_array().map(|v| (v + 0.5) as u16);
        Self {
            values: colours.iter().map(value).collect(),
            white,
        }
    }

    /// Colours of 0 to the largest among them.
    pub(crate) fn up_to_largest(colours: &[Vec3]) -> Self {
        let largest = colours
            .iter()
            .map(|colour| colour.max_element())
            .fold(0.0, f32::max);
        let white = if largest.is_normal() { largest } else { 1.0 };
        Self::up_to(colours, white)
    }

    /// Normals as colours `(n + 1) / 2`.
    pub(crate) fn normals(normals: &[Vec3]) -> Self {
        let colours: Vec<Vec3> = normals.iter().map(|&normal| (normal + 1.0) / 2.0).collect();
        Self::up_to(&colours, 1.0)
    }
}

/// The map as PNG, 0 outside the object.
pub(crate) fn encode_sixteen(buffer: &GBuffer, map: &Rgb16) -> Result<Vec<u8>, SynthError> {
    let values = buffer.spread(&map.values, [0; 3]).into_flattened();
    let pixels: Vec<u8> = values.into_iter().flat_map(u16::to_be_bytes).collect();
    let mut bytes = Vec::with_capacity(pixels.len() / 2);
    let mut encoder = png::Encoder::new(&mut bytes, buffer.size, buffer.size);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Sixteen);
    encoder.set_compression(Compression::Fastest);
    encoder.set_filter(Filter::Up);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&pixels)?;
    writer.finish()?;
    Ok(bytes)
}
