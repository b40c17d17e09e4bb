//! The loss of JPEG compression (ITU T.81): cosines of 8 x 8 blocks, rounded.

use std::f64::consts::PI;

use tch::Tensor;

use crate::engine::tensors::{columns, upload};
use relight_synth::PhotoCamera;

const SIDE: i64 = 8;

/// Table K.1 of ITU T.81: steps of luminance at quality 50.
const LUMINANCE: [f32; 64] = [
    16.0, 11.0, 10.0, 16.0, 24.0, 40.0, 51.0, 61.0, 12.0, 12.0, 14.0, 19.0, 26.0, 58.0, 60.0, 55.0,
    14.0, 13.0, 16.0, 24.0, 40.0, 57.0, 69.0, 56.0, 14.0, 17.0, 22.0, 29.0, 51.0, 87.0, 80.0, 62.0,
    18.0, 22.0, 37.0, 56.0, 68.0, 109.0, 103.0, 77.0, 24.0, 35.0, 55.0, 64.0, 81.0, 104.0, 113.0,
    92.0, 49.0, 64.0, 78.0, 87.0, 103.0, 121.0, 120.0, 101.0, 72.0, 92.0, 95.0, 98.0, 112.0, 100.0,
    103.0, 99.0,
];
/// Table K.2: steps of colour.
const CHROMINANCE: [f32; 64] = [
    17.0, 18.0, 24.0, 47.0, 99.0, 99.0, 99.0, 99.0, 18.0, 21.0, 26.0, 66.0, 99.0, 99.0, 99.0, 99.0,
    24.0, 26.0, 56.0, 99.0, 99.0, 99.0, 99.0, 99.0, 47.0, 66.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0,
    99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0,
    99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0,
];
/// Rows: luminance, blue and red difference (ITU T.871).
const TO_YCC: [f32; 9] = [
    0.299, 0.587, 0.114, -0.168_736, -0.331_264, 0.5, 0.5, -0.418_688, -0.081_312,
];
const FROM_YCC: [f32; 9] = [
    1.0, 0.0, 1.402, 1.0, -0.344_136, -0.714_136, 1.0, 1.772, 0.0,
];

/// Values, 0..=255 and `batch x 3 x side x side`, after their cameras' compression. The side is a multiple of 16.
pub(super) fn compressed(values: &Tensor, cameras: &[&PhotoCamera]) -> Tensor {
    let colours = mixed(values, &TO_YCC);
    let luminance = rounded(
        &(colours.narrow(1, 0, 1) - 128.0),
        &steps(cameras, &LUMINANCE, values),
    ) + 128.0;
    let fine = colours.narrow(1, 1, 2);
    let table = steps(cameras, &CHROMINANCE, values);
    let coarse = fine.avg_pool2d([2; 2], [2; 2], [0; 2], false, true, None);
    let size = values.size();
    let coarse =
        rounded(&coarse, &table).upsample_nearest2d([size[2], size[3]], None::<f64>, None::<f64>);
    let halved: Vec<f32> = cameras
        .iter()
        .map(|camera| f32::from(u8::from(camera.jpeg.is_some_and(|(_, halved)| halved))))
        .collect();
    let is_halved = columns(&halved, cameras.len(), values).gt(0.5);
    let colour = coarse.where_self(&is_halved, &rounded(&fine, &table));
    let all = Tensor::cat(&[luminance, colour], 1);
    mixed(&all, &FROM_YCC).round().clamp(0.0, 255.0)
}

/// Channels mixed by the rows of a matrix.
fn mixed(of: &Tensor, rows: &[f32; 9]) -> Tensor {
    let mixed = upload(rows, &[3, 3], of).matmul(&of.flatten(2, -1));
    mixed.reshape(of.size())
}

/// The steps of each camera's quality, `batch x 1 x 1 x 1 x 8 x 8`, as libjpeg scales them.
fn steps(cameras: &[&PhotoCamera], table: &[f32; 64], like: &Tensor) -> Tensor {
    let values: Vec<f32> = cameras
        .iter()
        .flat_map(|camera| {
            let quality = camera.jpeg.map_or(100.0, |(quality, _)| f32::from(quality));
            let scale = if quality < 50.0 {
                5000.0 / quality
            } else {
                200.0 - 2.0 * quality
            };
            table.map(|step| ((step * scale + 50.0) / 100.0).floor().clamp(1.0, 255.0))
        })
        .collect();
    upload(&values, &[cameras.len() as i64, 1, 1, 1, SIDE, SIDE], like)
}

/// Planes whose blocks' cosines are rounded to these steps.
fn rounded(of: &Tensor, steps: &Tensor) -> Tensor {
    let size = of.size();
    let blocks = of
        .reshape([size[0], size[1], size[2] / SIDE, SIDE, size[3] / SIDE, SIDE])
        .transpose(3, 4);
    let cosines = cosines(of);
    let back = cosines.transpose(0, 1);
    let rounded = (cosines.matmul(&blocks).matmul(&back) / steps).round() * steps;
    back.matmul(&rounded)
        .matmul(&cosines)
        .transpose(3, 4)
        .reshape(size)
}

/// The orthonormal cosine transform of 8 values: a row for each frequency.
fn cosines(like: &Tensor) -> Tensor {
    let value = |at: usize| {
        let (frequency, place) = ((at / 8) as f64, (at % 8) as f64);
        let scale = if at < 8 { 0.125_f64.sqrt() } else { 0.5 };
        scale * (PI * (2.0 * place + 1.0) * frequency / 16.0).cos()
    };
    let values: Vec<f64> = (0..64).map(value).collect();
    Tensor::from_slice(&values)
        .reshape([SIDE, SIDE])
        .to_kind(like.kind())
        .to_device(like.device())
}

#[cfg(test)]
mod tests {
    use super::*;
    use tch::Kind;

    fn camera(quality: u8, halved: bool) -> PhotoCamera {
        PhotoCamera {
            balance: [1.0; 3],
            level: 1.0,
            gamma: None,
            taken_as_srgb: false,
            read_noise: 0.0,
            shot_noise: 0.0,
            blur: 0.0,
            jpeg: Some((quality, halved)),
        }
    }

    /// A picture with an edge and a gradient.
    fn picture() -> image::RgbImage {
        image::RgbImage::from_fn(32, 32, |x, y| {
            let edge = if x + y > 30 { 180 } else { 40 };
            image::Rgb([edge, (4 * x + 3 * y) as u8, 220 - edge])
        })
    }

    #[test]
    fn a_picture_loses_what_an_encoder_takes_from_it() {
        let picture = picture();
        let planes: Vec<f32> = (0..3)
            .flat_map(|c| picture.pixels().map(move |pixel| f32::from(pixel.0[c])))
            .collect();
        let values = Tensor::from_slice(&planes).reshape([1, 3, 32, 32]);
        for quality in [30, 60, 95] {
            let mut bytes = Vec::new();
            image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, quality)
                .encode_image(&picture)
                .unwrap();
            let real = image::load_from_memory(&bytes).unwrap().into_rgb8();
            let found = compressed(&values, &[&camera(quality, false)]);
            let found = Vec::<f32>::try_from(found.flatten(0, -1)).unwrap();
            let (mut apart, mut lost) = (0.0, 0.0);
            for (at, value) in found.iter().enumerate() {
                let pixel = real.get_pixel((at % 32) as u32, (at / 32 % 32) as u32);
                apart += (value - f32::from(pixel.0[at / 1024])).abs();
                lost += (value - planes[at]).abs();
            }
            // Encoders and decoders round in between as well.
            let rounding = 1.0 * found.len() as f32;
            assert!(apart < 0.3 * lost + rounding, "{quality}: {apart} {lost}");
        }
    }

    #[test]
    fn halved_colours_lose_fine_colours_and_keep_luminance() {
        // Stripes of two colours as bright as each other.
        let (orange, blue) = ([200.0, 100.0, 40.0], [93.0_f32, 133.0, 150.0]);
        let stripe = |x: usize| if x.is_multiple_of(2) { orange } else { blue };
        let planes: Vec<f32> = (0..3 * 1024).map(|at| stripe(at % 32)[at / 1024]).collect();
        let values = Tensor::from_slice(&planes).reshape([1, 3, 32, 32]);
        let lost = |halved| {
            let found = compressed(&values, &[&camera(98, halved)]);
            (found - &values).abs().mean(Kind::Float).double_value(&[])
        };
        assert!(lost(false) < 3.0 && lost(true) > 20.0);
    }
}
