//! One synthetic picture with its ground truth, as arrays for a batch.

use glam::Vec3;
use half::f16;
use tch::{Device, Kind, Tensor};

use relight_core::image::{ColourSpace, Extent, Planes, Srgb};
use relight_photo::decompose::{NetworkInput, PredictedLight};
use relight_photo::nets::{INPUTS, LIGHT_OUTPUTS};
use relight_synth::SynthSample;

/// Planes of a sample: the input, the linear picture, shading, albedo, normals, highlight.
const PLANES: usize = INPUTS + 3 + 1 + 3 + 3 + 1;

/// How the values of a synthetic picture are converted to light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Linearisation {
    /// By the response of the camera that made it: the picture is exactly albedo times shading plus highlight.
    Exact,
    /// As sRGB, like a photograph from an unknown camera.
    AsSrgb,
}

/// A picture as the decomposing network sees it, and its ground truth. Light is in parts of the picture's white; shading
/// has the mean 1 under the mask. Half precision, as many are kept.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TruthArrays {
    extent: Extent,
    values: Vec<f16>,
    /// The ground truth of the head for light; 0 if the light is not known.
    light: [f32; LIGHT_OUTPUTS],
}

/// A batch of them on a device, `batch x channels x height x width`.
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
    /// Visible highlight, 1 channel, in whites.
    pub highlight: Tensor,
    /// The ground truth of the head for light, `batch x 9`; 0 if the light is not known.
    pub light: Tensor,
}

impl TruthArrays {
    /// The arrays of a sample.
    pub(crate) fn new(sample: &SynthSample<'_>, linearisation: Linearisation) -> Self {
        let (picture, mask) = (
            linear(sample, linearisation),
            sample.view.scene.buffer().mask(),
        );
        let encoded = NetworkInput::new(&picture, &mask);
        let extent = encoded.extent();
        let pixels = extent.pixels();
        let mut values = Vec::with_capacity(PLANES * pixels);
        values.extend(encoded.values().iter().map(|&v| f16::from_f32(v)));
        let white = encoded.white();
        for plane in picture.planes() {
            values.extend(plane.iter().map(|v| f16::from_f32(v / white)));
        }
        values.resize(PLANES * pixels, f16::ZERO);
        let mean = mean_shading(sample);
        let truth = &mut values[(INPUTS + 3) * pixels..];
        fill_truth(sample, white, mean, truth, pixels);
        let light = sample.coefficients();
        let light = PredictedLight::from_light(light, f64::from(mean));
        Self {
            extent,
            values,
            light: light.numbers().map(|number| number as f32),
        }
    }
}

/// The mean of the shading; above 0, also of an object on which no light falls.
fn mean_shading(sample: &SynthSample<'_>) -> f32 {
    let shading = &sample.shaded.shading;
    let total: f32 = shading.iter().map(|light| light.element_sum() / 3.0).sum();
    (total / shading.len().max(1) as f32).max(1e-6)
}

/// The ground truth at the covered pixels.
fn fill_truth(sample: &SynthSample<'_>, white: f32, mean: f32, values: &mut [f16], pixels: usize) {
    let grey = |light: &Vec3| light.element_sum() / 3.0;
    let (shaded, material) = (&sample.shaded, &sample.material);
    let buffer = sample.view.scene.buffer();
    for (at, &pixel) in buffer.pixels.iter().enumerate() {
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
    let level = |level: usize| {
        let value = level as f32 / 255.0;
        match linearisation {
            Linearisation::Exact => sample.light_of(value),
            Linearisation::AsSrgb => Srgb::to_linear(value),
        }
    };
    let levels: [f32; 256] = std::array::from_fn(level);
    let image = &sample.image;
    let extent = Extent::new(image.width() as usize, image.height() as usize);
    Planes::from_fn(extent, |x, y| {
        image
            .get_pixel(x as u32, y as u32)
            .0
            .map(|value| levels[usize::from(value)])
    })
}

impl TruthBatch {
    /// A batch of samples of one size, on a device, in 32 or 64 bits.
    pub(crate) fn new(samples: &[TruthArrays], kind: Kind, device: Device) -> Self {
        let extent = samples
            .first()
            .map_or(Extent::new(0, 0), |first| first.extent);
        let values: Vec<f16> = samples
            .iter()
            .flat_map(|sample| sample.values.iter().copied())
            .collect();
        let lights: Vec<f32> = samples.iter().flat_map(|sample| sample.light).collect();
        let light = Tensor::from_slice(&lights).reshape([-1, LIGHT_OUTPUTS as i64]);
        let shape = [samples.len(), PLANES, extent.height, extent.width].map(|n| n as i64);
        let all = Tensor::from_slice(&values)
            .reshape(shape)
            .to_device(device)
            .to_kind(kind);
        let part = |from: usize, count: usize| all.narrow(1, from as i64, count as i64);
        Self {
            input: part(0, INPUTS),
            mask: part(relight_photo::decompose::MASK, 1),
            picture: part(INPUTS, 3),
            shading: part(INPUTS + 3, 1),
            albedo: part(INPUTS + 4, 3),
            normals: part(INPUTS + 7, 3),
            highlight: part(INPUTS + 10, 1),
            light: light.to_device(device).to_kind(kind),
        }
    }
}
