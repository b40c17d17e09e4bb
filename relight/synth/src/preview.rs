//! Contact sheets: samples beside their ground truth.

use std::path::Path;

use glam::Vec3;
use image::{Rgb, RgbImage};
use rayon::prelude::*;
use relit_data::durable::write_whole;

use super::SynthError;
use super::camera::Response;
use super::geometry::GBuffer;
use super::library::Library;
use super::recipe::Recipe;
use super::sample::{SynthSample, picture_of};
use relight_core::statistics::ranked;

/// What stands beside each other: picture, albedo, shading, highlight, normals.
const PARTS: u32 = 5;
/// Samples in a row of the sheet.
const ACROSS: u32 = 2;
/// Pixels between pictures.
const GAP: u32 = 2;
/// Grey between them.
const GROUND: Rgb<u8> = Rgb([24; 3]);

/// Writes a PNG of the first `count` objects of a recipe, one sample each, two in a row: picture, albedo,
/// shading, highlight and normals.
///
/// # Errors
/// Where a setting is out of range or the file cannot be written.
pub fn write_preview(
    recipe: &Recipe,
    library: &Library,
    count: u32,
    path: &Path,
) -> Result<(), SynthError> {
    recipe.check()?;
    let strips: Vec<RgbImage> = (0..count)
        .into_par_iter()
        .map(|k| strip(recipe, library, k))
        .collect();
    let cell = recipe.size + GAP;
    let rows = count.div_ceil(ACROSS);
    let mut sheet = RgbImage::from_pixel(ACROSS * PARTS * cell + GAP, rows * cell + GAP, GROUND);
    for (k, strip) in (0..count).zip(&strips) {
        let place = [k % ACROSS * PARTS, k / ACROSS].map(|at| i64::from(at * cell + GAP));
        image::imageops::replace(&mut sheet, strip, place[0], place[1]);
    }
    let bytes = relit_data::shard::encode_rgb(&sheet)?;
    write_whole(path, &bytes).map_err(SynthError::write(path))
}

fn strip(recipe: &Recipe, library: &Library, number: u32) -> RgbImage {
    let first = u64::from(number) * recipe.samples_an_object();
    let (object, mesh) = recipe.object(library, u64::from(number));
    let view = recipe.view(&object, &mesh, first / u64::from(recipe.lightings));
    let parts = parts(&recipe.sample(library, &view, first));
    let cell = recipe.size + GAP;
    let mut strip = RgbImage::from_pixel(PARTS * cell - GAP, recipe.size, GROUND);
    for (k, part) in (0..).zip(&parts) {
        image::imageops::replace(&mut strip, part, i64::from(k * cell), 0);
    }
    strip
}

fn parts(sample: &SynthSample<'_>) -> [RgbImage; PARTS as usize] {
    let buffer = sample.view().scene.buffer();
    let shaded = sample.shaded();
    let normals: Vec<Vec3> = sample
        .material()
        .normals
        .iter()
        .map(|&n| (n + 1.0) / 2.0)
        .collect();
    [
        sample.image().clone(),
        shown(buffer, &sample.material().albedo, 1.0),
        shown(buffer, &shaded.shading, bright(&shaded.shading)),
        shown(buffer, &shaded.highlight, 1.0),
        picture_of(buffer, &values(&normals, |v| v)),
    ]
}

/// Linear colours of 0..=`white` as sRGB.
fn shown(buffer: &GBuffer, colours: &[Vec3], white: f32) -> RgbImage {
    picture_of(
        buffer,
        &values(colours, |v| Response::Srgb.encode(v / white)),
    )
}

fn values(colours: &[Vec3], encode: impl Fn(f32) -> f32) -> Vec<[u8; 3]> {
    let value = |colour: &Vec3| colour.to_array().map(|v| (encode(v) * 255.0).round() as u8);
    colours.iter().map(value).collect()
}

/// What one value in a hundred exceeds.
fn bright(colours: &[Vec3]) -> f32 {
    let mut levels: Vec<f32> = colours.iter().map(|colour| colour.max_element()).collect();
    let place = levels.len() * 99 / 100;
    let Some(level) = ranked(&mut levels, place) else {
        return 1.0;
    };
    level.max(1e-6)
}
