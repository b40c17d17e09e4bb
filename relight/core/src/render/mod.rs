//! Light on surfaces that are given by their normals: the paper's render layers, and a specular layer that is
//! closer to the ground truth. Knows light and images only.
//!
//! All of it is in the paper's units: I = A S + H, where S is the irradiance and H the integral of
//! radiance times the specular lobe, without a factor 1/π. Under even light of radiance 1 a white diffuse
//! surface is π; [`EXPOSURE`] brings it to 1.

mod diffuse;
mod fit;
mod layers;
mod lobe;
mod power;
mod sequence;
mod series;
mod simd;
mod surface;

pub use diffuse::{DiffuseForm, DiffuseLayer, RELEASED_AMBIENT, cosine_lobe, diffuse_constants};
pub use fit::{fit_light, fit_light_near};
pub use layers::{EXPOSURE, Layers, Rendering, SpecularForm};
pub use lobe::LobeLayer;
pub use power::{PowerLayer, power_constants};
pub use sequence::{RenderSettings, exposure_for, mirror_reflectance};
pub use surface::{Gloss, Surface};

use crate::image::{ImageError, Linear, Planes, Rgb, check_extent};
use crate::light::Normals;
use simd::Kernel;

/// The highlight H of a whole image.
fn highlight(
    layer: &impl Kernel<7, 3>,
    normals: &Normals,
    gloss: &Gloss,
) -> Result<Rgb<Linear>, ImageError> {
    check_extent("map of gloss", gloss.extent(), normals.extent())?;
    let mut highlight = Planes::zeros(normals.extent());
    let [x, y, z] = normals.planes().planes();
    let [red, green, blue] = gloss.reflectance().planes();
    let inputs = [x, y, z, red, green, blue, gloss.smoothness().plane(0)];
    simd::run(layer, inputs, highlight.planes_mut());
    Ok(Rgb::new(highlight))
}
