//! One made picture with its truth, as the arrays that a batch is made of.

use std::collections::BTreeMap;

use glam::Vec3;
use half::f16;
use rayon::prelude::*;
use tch::{Device, Kind, Tensor};

use super::error::TrainError;
use crate::decompose::EncodedPicture;
use crate::image::{ColourSpace, Extent, Planes, Srgb};
use crate::nets::INPUTS;
use crate::synth::SynthSample;

/// Planes of a sample: the input, the linear picture, shading, albedo, normals, highlight.
const PLANES: usize = INPUTS + 3 + 1 + 3 + 3 + 1;

/// How the values of a made picture are taken for light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Linearisation {
    /// By the response of the camera that made it: the picture is exactly albedo times shading plus highlight.
    Exact,
    /// As sRGB, as a photograph is taken whose camera nobody knows.
    AsSrgb,
}

/// A picture as the decomposing network sees it, and its truth. Light is in parts of the picture's white; shading
/// has the mean 1 under the mask. Half precision, as many are kept.
#[derive(Debug, Clone, PartialEq)]
pub struct TruthArrays {
    extent: Extent,
    values: Vec<f16>,
}

/// A batch of them on a device, 32 bits, `batch x channels x height x width`.
#[derive(Debug)]
pub struct TruthBatch {
    /// What the network sees.
    pub input: Tensor,
    /// 1 inside the mask, 1 channel.
    pub mask: Tensor,
    /// Linear picture, in whites.
    pub picture: Tensor,
    /// Shading, 1 channel, of mean 1 under the mask.
    pub shading: Tensor,
    /// Linear albedo.
    pub albedo: Tensor,
    /// Unit normals, y up.
    pub normals: Tensor,
    /// Highlight, 1 channel, in whites: what of it the picture shows.
    pub highlight: Tensor,
}

impl TruthArrays {
    /// The arrays of a sample.
    #[must_use]
    pub fn new(sample: &SynthSample<'_>, linearisation: Linearisation) -> Self {
        let (picture, mask) = (
            linear(sample, linearisation),
            sample.view().scene.buffer().mask(),
        );
        let encoded = EncodedPicture::new(&picture, &mask);
        let extent = encoded.extent();
        let pixels = extent.pixels();
        let mut values = Vec::with_capacity(PLANES * pixels);
        values.extend(encoded.values().iter().map(|&v| f16::from_f32(v)));
        let white = encoded.white();
        for plane in picture.planes() {
            values.extend(plane.iter().map(|v| f16::from_f32(v / white)));
        }
        values.resize(PLANES * pixels, f16::ZERO);
        fill_truth(sample, white, &mut values[(INPUTS + 3) * pixels..], pixels);
        Self { extent, values }
    }

    /// Width and height.
    #[must_use]
    pub fn extent(&self) -> Extent {
        self.extent
    }
}

/// The truth at the covered pixels.
fn fill_truth(sample: &SynthSample<'_>, white: f32, values: &mut [f16], pixels: usize) {
    let grey = |light: &Vec3| light.element_sum() / 3.0;
    let (shaded, material) = (sample.shaded(), sample.material());
    let buffer = sample.view().scene.buffer();
    let total: f32 = shaded.shading.iter().map(grey).sum();
    // Of an object on which no light falls, shading is 0.
    let mean = (total / buffer.len().max(1) as f32).max(1e-6);
    for (at, &pixel) in buffer.pixels().iter().enumerate() {
        let (albedo, normal) = (material.albedo[at], material.normals[at]);
        let truth = [
            grey(&shaded.shading[at]) / mean,
            albedo.x,
            albedo.y,
            albedo.z,
            normal.x,
            normal.y,
            normal.z,
            visible_highlight(albedo * shaded.shading[at], shaded.highlight[at]) / white,
        ];
        for (plane, value) in truth.into_iter().enumerate() {
            values[plane * pixels + pixel as usize] = f16::from_f32(value);
        }
    }
}

/// What a highlight adds to a picture that is clipped at 1, mean over the channels: the picture less this is the
/// diffuse light that it shows, also where it is clipped.
fn visible_highlight(diffuse: Vec3, highlight: Vec3) -> f32 {
    let shown = (diffuse + highlight).min(Vec3::ONE) - diffuse.min(Vec3::ONE);
    shown.element_sum() / 3.0
}

/// The picture's light.
fn linear(sample: &SynthSample<'_>, linearisation: Linearisation) -> Planes<3> {
    let response = sample.description().camera.response;
    let level = |level: usize| {
        let value = level as f32 / 255.0;
        match linearisation {
            Linearisation::Exact => response.decode(value),
            Linearisation::AsSrgb => Srgb::to_linear(value),
        }
    };
    let levels: [f32; 256] = std::array::from_fn(level);
    let image = sample.image();
    let extent = Extent::new(image.width() as usize, image.height() as usize);
    Planes::from_fn(extent, |x, y| {
        image
            .get_pixel(x as u32, y as u32)
            .0
            .map(|value| levels[usize::from(value)])
    })
}

impl TruthBatch {
    /// A batch on a device; every second sample is mirrored, normals and all, where `mirror` is set. All samples have one size.
    ///
    /// # Errors
    /// [`TrainError::Torch`].
    pub fn new(samples: &[&TruthArrays], mirror: bool, device: Device) -> Result<Self, TrainError> {
        let extent = samples
            .first()
            .map_or(Extent::new(0, 0), |first| first.extent);
        let each = PLANES * extent.pixels();
        let mut bytes = vec![0_u8; 2 * each * samples.len()];
        bytes
            .par_chunks_exact_mut(2 * each.max(1))
            .zip(samples)
            .for_each(|(to, sample)| {
                for (to, from) in to.chunks_exact_mut(2).zip(&sample.values) {
                    to.copy_from_slice(&from.to_le_bytes());
                }
            });
        let shape = [samples.len(), PLANES, extent.height, extent.width].map(|n| n as i64);
        let all = Tensor::f_from_data_size(&bytes, &shape, Kind::Half)?
            .f_to_device(device)?
            .f_to_kind(Kind::Float)?;
        let all = if mirror { mirrored(&all)? } else { all };
        let part = |from: usize, count: usize| all.f_narrow(1, from as i64, count as i64);
        Ok(Self {
            input: part(0, INPUTS)?,
            mask: part(crate::decompose::MASK, 1)?,
            picture: part(INPUTS, 3)?,
            shading: part(INPUTS + 3, 1)?,
            albedo: part(INPUTS + 4, 3)?,
            normals: part(INPUTS + 7, 3)?,
            highlight: part(INPUTS + 10, 1)?,
        })
    }
}

impl TruthBatch {
    /// The tensors by name. They share their numbers.
    #[must_use]
    pub fn named(&self) -> BTreeMap<String, Tensor> {
        [
            ("input", &self.input),
            ("picture", &self.picture),
            ("shading", &self.shading),
            ("albedo", &self.albedo),
            ("normals", &self.normals),
            ("highlight", &self.highlight),
        ]
        .map(|(name, tensor)| (name.to_owned(), tensor.shallow_clone()))
        .into()
    }
}

/// The second half of a batch from right to left; x of its normals changes sign.
fn mirrored(all: &Tensor) -> Result<Tensor, tch::TchError> {
    let count = all.size()[0];
    let kept = all.f_narrow(0, 0, count / 2)?;
    let turned = all.f_narrow(0, count / 2, count - count / 2)?.f_flip([3])?;
    let mut x = turned.f_narrow(1, INPUTS as i64 + 7, 1)?;
    let _ = x.f_neg_()?;
    Tensor::f_cat(&[kept, turned], 0)
}
