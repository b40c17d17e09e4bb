//! All maps as layers of one EXR file, 32-bit floating point, linear, compressed without loss.
//!
//! `R`, `G`, `B`, `A`: the albedo multiplied with alpha, which programs without layers show. `albedo.R` ..., `normal.X`
//! ..., `specular.R` ..., `smoothness.Y`, `confidence.Y`, `height.Z`: the maps themselves. Heights are in pixels.

use std::io::Cursor;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, WritableImage,
};
use relight_core::captured_object::CapturedObject;
use relight_core::image::{ImageError, Planes};
use relight_core::light::Normals;

use super::heights::integrated;
use super::not_encoded;

/// The longest side at which heights are found, pixels: larger maps have them enlarged.
const MAX_SIDE: usize = 512;

/// The content of the file.
///
/// # Errors
/// If it cannot be encoded.
pub fn to_layers(object: &CapturedObject) -> Result<Vec<u8>, ImageError> {
    let surface = object.surface();
    let alpha = object.alpha().plane(0);
    let mut channels = Vec::new();
    let mut add = |name: String, values: Vec<f32>| {
        channels.push(AnyChannel::new(name.as_str(), FlatSamples::F32(values)));
    };
    let albedo = surface.albedo().planes();
    for (letter, plane) in ["R", "G", "B"].into_iter().zip(albedo.planes()) {
        let seen = plane.iter().zip(alpha).map(|(value, alpha)| value * alpha);
        add(letter.to_owned(), seen.collect());
        add(format!("albedo.{letter}"), plane.to_vec());
    }
    add("A".to_owned(), alpha.to_vec());
    let normals = surface.normals().planes();
    for (letter, plane) in ["X", "Y", "Z"].into_iter().zip(normals.planes()) {
        add(format!("normal.{letter}"), plane.to_vec());
    }
    if let Some(gloss) = surface.gloss() {
        let reflectance = gloss.reflectance().planes();
        for (letter, plane) in ["R", "G", "B"].into_iter().zip(reflectance) {
            add(format!("specular.{letter}"), plane.to_vec());
        }
        add(
            "smoothness.Y".to_owned(),
            gloss.smoothness().plane(0).to_vec(),
        );
    }
    add(
        "confidence.Y".to_owned(),
        object.confidence().plane(0).to_vec(),
    );
    add("height.Z".to_owned(), heights(object));
    encode(object, channels)
}

fn encode(
    object: &CapturedObject,
    channels: Vec<AnyChannel<FlatSamples>>,
) -> Result<Vec<u8>, ImageError> {
    let extent = object.extent();
    let attributes = LayerAttributes {
        software_name: Some(concat!("relight ", env!("CARGO_PKG_VERSION")).into()),
        ..LayerAttributes::default()
    };
    let layer = Layer::new(
        (extent.width, extent.height),
        attributes,
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels.into_iter().collect()),
    );
    let mut file = Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .to_buffered(&mut file)
        .map_err(not_encoded)?;
    Ok(file.into_inner())
}

/// The heights of all pixels, in pixels.
fn heights(object: &CapturedObject) -> Vec<f32> {
    let extent = object.extent();
    let grid = extent.at_most(MAX_SIDE);
    let inside: Vec<bool> = object
        .alpha()
        .resized(grid)
        .plane(0)
        .iter()
        .map(|&alpha| alpha >= 0.5)
        .collect();
    let normals = Normals::new(object.surface().normals().planes().resized(grid));
    let found = integrated(&normals.completed(&inside), &inside);
    let scale = extent.width as f32 / grid.width as f32;
    match Planes::from_planes(grid, [found]) {
        Ok(found) => {
            let [heights] = found.resized(extent).into_planes();
            heights.into_iter().map(|height| height * scale).collect()
        }
        // The grid has as many pixels as heights were found.
        Err(_) => vec![0.0; extent.pixels()],
    }
}
