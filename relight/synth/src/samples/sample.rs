//! One sample: a picture, its ground truth, and all its parameters.

use glam::Vec3;
use image::{GrayImage, RgbImage};
use serde::{Deserialize, Serialize};

use super::camera::CameraModel;
use super::finish::Finish;
use super::object::{ObjectSource, SyntheticView};
use super::png::{Rgb16, encode_sixteen};
use crate::SynthError;
use crate::geometry::GBuffer;
use crate::lighting::{Lighting, Material, Panoramas, Shaded};
use crate::view::{Pose, Projection};
use relight_core::light::{Order, ShLight};

/// All that a sample was made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Description {
    /// The sample's number.
    pub number: u64,
    /// The seed of its draws.
    pub seed: u64,
    /// The object.
    pub object: ObjectSource,
    /// How it stands.
    pub pose: Pose,
    /// How it is seen.
    pub projection: Projection,
    /// The object's finish.
    pub finish: Finish,
    /// The name of the panorama that the lighting has.
    pub panorama: Option<String>,
    /// All light except what bounces, as nine coefficients in the viewer's frame, times the camera's gain:
    /// without shadows, their diffuse layer is the shading.
    pub coefficients: [[f64; 3]; 9],
    /// The light.
    pub lighting: Lighting,
    /// The camera.
    pub camera: CameraModel,
}

impl Lighting {
    /// The name of its panorama.
    pub(crate) fn panorama_name(&self, panoramas: &Panoramas) -> Option<String> {
        let environment = self.environment.as_ref()?;
        panoramas.name(environment.panorama).map(str::to_owned)
    }

    /// All light but what bounces, as a camera of this gain sees it.
    pub(crate) fn seen(&self, order: Order, panoramas: &Panoramas, gain: Vec3) -> ShLight {
        self.coefficients(order, panoramas)
            .tinted(gain.to_array().map(f64::from))
    }

    /// Its first nine coefficients.
    pub(crate) fn seen_coefficients(&self, panoramas: &Panoramas, gain: Vec3) -> [[f64; 3]; 9] {
        let light = self.seen(Order::TWO, panoramas, gain);
        let mut coefficients = [[0.0; 3]; 9];
        for (to, from) in coefficients.iter_mut().zip(light.coefficients()) {
            *to = *from;
        }
        coefficients
    }
}

/// A picture with its ground truth.
pub struct SynthSample<'a> {
    /// The view that is shown.
    pub view: &'a SyntheticView,
    /// Albedo, normals and gloss at the covered pixels.
    pub material: Material,
    /// Shading and highlight at the covered pixels, with the camera's gain: the picture is the camera's response to
    /// `albedo x shading + highlight`.
    pub shaded: Shaded,
    /// The picture: the camera's 8-bit values, 0 outside the object.
    pub image: RgbImage,
    pub(crate) description: Description,
}

/// The light of the largest value in a 16-bit file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct WhiteLevels {
    /// In `shading.png`.
    pub shading: f32,
    /// In `highlight.png`.
    pub highlight: f32,
}

impl<'a> SynthSample<'a> {
    /// Takes the picture: `shaded` is still without the gain of the description's camera; `seed` draws
    /// the noise.
    pub(crate) fn new(
        view: &'a SyntheticView,
        material: Material,
        mut shaded: Shaded,
        description: Description,
        seed: u64,
    ) -> Self {
        shaded.scale(description.camera.gain);
        let buffer = view.scene.buffer();
        let image = photograph(buffer, &description.camera, &material, &shaded, seed);
        Self {
            view,
            material,
            shaded,
            image,
            description,
        }
    }

    /// All light but what bounces, as nine coefficients in the viewer's frame, times the camera's gain.
    pub fn coefficients(&self) -> &[[f64; 3]; 9] {
        &self.description.coefficients
    }

    /// The light, 0..=1, for a value of the picture, 0..=1: the inverse of its camera's response.
    pub fn light_of(&self, value: f32) -> f32 {
        self.description.camera.response.decode(value)
    }

    /// The sample as files, by name.
    pub(crate) fn files(&self) -> Result<Vec<(&'static str, Vec<u8>)>, SynthError> {
        let buffer = self.view.scene.buffer();
        let shading = Rgb16::up_to_largest(&self.shaded.shading);
        let highlight = Rgb16::up_to_largest(&self.shaded.highlight);
        let whites = WhiteLevels {
            shading: shading.white,
            highlight: highlight.white,
        };
        let light = ShLight::new(self.description.coefficients.to_vec())?;
        Ok(vec![
            ("image.png", relit_data::shard::encode_rgb(&self.image)?),
            ("mask.png", relit_data::shard::encode_mask(&mask(buffer))?),
            (
                "normal.png",
                encode_sixteen(buffer, &Rgb16::normals(&self.material.normals))?,
            ),
            (
                "albedo.png",
                encode_sixteen(buffer, &Rgb16::up_to(&self.material.albedo, 1.0))?,
            ),
            ("shading.png", encode_sixteen(buffer, &shading)?),
            ("highlight.png", encode_sixteen(buffer, &highlight)?),
            ("light.txt", light.to_string().into_bytes()),
            ("sample.json", self.json(whites)),
        ])
    }

    fn json(&self, white: WhiteLevels) -> Vec<u8> {
        #[derive(Serialize)]
        struct Record<'a> {
            white: WhiteLevels,
            #[serde(flatten)]
            description: &'a Description,
        }
        let record = Record {
            white,
            description: &self.description,
        };
        // All numbers are finite and all keys are texts: this cannot fail.
        serde_json::to_vec_pretty(&record).unwrap_or_default()
    }
}

/// The mask of what a buffer covers, 0 and 255.
pub(crate) fn mask(buffer: &GBuffer) -> GrayImage {
    let values = buffer.spread(&vec![255; buffer.len()], 0);
    GrayImage::from_raw(buffer.size, buffer.size, values).unwrap_or_default()
}

/// The camera's picture of light that already has its gain.
pub(crate) fn photograph(
    buffer: &GBuffer,
    camera: &CameraModel,
    material: &Material,
    shaded: &Shaded,
    seed: u64,
) -> RgbImage {
    let values = camera.values(&shaded.image(&material.albedo), seed);
    let picture = picture_of(buffer, &values);
    if camera.jpeg.is_none() {
        return picture;
    }
    let compressed = camera.compressed(picture);
    let size = buffer.size;
    let inside = buffer
        .pixels
        .iter()
        .map(|&pixel| compressed.get_pixel(pixel % size, pixel / size).0);
    picture_of(buffer, &inside.collect::<Vec<_>>())
}

/// A picture with these colours at the covered pixels and black elsewhere.
pub(crate) fn picture_of(buffer: &GBuffer, values: &[[u8; 3]]) -> RgbImage {
    let values = buffer.spread(values, [0; 3]).into_flattened();
    RgbImage::from_raw(buffer.size, buffer.size, values).unwrap_or_default()
}
