//! From a captured object to bytes.

use std::collections::BTreeMap;
use std::io::{Cursor, Write};

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::CapturedObject;
use super::manifest::{CAPTURED_OBJECT_SCHEMA, MANIFEST, Manifest, damaged, no_archive};
use crate::image::{ImageError, Planes};

type Archive = ZipWriter<Cursor<Vec<u8>>>;

impl CapturedObject {
    /// The content of a file.
    ///
    /// # Errors
    /// If a map cannot be encoded.
    pub fn to_bytes(&self) -> Result<Vec<u8>, ImageError> {
        let surface = self.surface();
        let mut white = BTreeMap::new();
        let mut maps: Vec<(&'static str, Vec<u8>)> = Vec::new();
        maps.push(("alpha.png", png("alpha.png", self.alpha(), 1.0)?));
        let normals = surface.normals().to_colours();
        maps.push(("normal.png", png("normal.png", &normals, 1.0)?));
        let albedo = surface.albedo().planes();
        let most = largest(albedo);
        white.insert("albedo".to_owned(), most);
        maps.push(("albedo.png", png("albedo.png", albedo, most)?));
        if let Some(gloss) = surface.gloss() {
            let most = largest(gloss.reflectance());
            white.insert("specular".to_owned(), most);
            let specular = png("specular.png", gloss.reflectance(), most)?;
            maps.push(("specular.png", specular));
            let most = largest(gloss.smoothness());
            white.insert("smoothness".to_owned(), most);
            let smoothness = png("smoothness.png", gloss.smoothness(), most)?;
            maps.push(("smoothness.png", smoothness));
        }
        let confidence = png("confidence.png", self.confidence(), 1.0)?;
        maps.push(("confidence.png", confidence));

        let manifest = Manifest {
            schema: CAPTURED_OBJECT_SCHEMA.to_owned(),
            software: format!("relight {}", env!("CARGO_PKG_VERSION")),
            name: self.name().to_owned(),
            width: self.extent().width,
            height: self.extent().height,
            white,
        };
        let json = serde_json::to_vec_pretty(&manifest).map_err(damaged(MANIFEST))?;
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        add(&mut archive, MANIFEST, &json)?;
        for (name, content) in &maps {
            add(&mut archive, name, content)?;
        }
        Ok(archive.finish().map_err(no_archive)?.into_inner())
    }
}

fn add(archive: &mut Archive, name: &'static str, content: &[u8]) -> Result<(), ImageError> {
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    archive.start_file(name, options).map_err(no_archive)?;
    archive.write_all(content).map_err(damaged(name))
}

/// The largest finite value; 1 where all are 0.
fn largest<const C: usize>(planes: &Planes<C>) -> f32 {
    let values = planes.planes().into_iter().flatten().copied();
    let most = values.filter(|v| v.is_finite()).fold(0.0_f32, f32::max);
    if most > 0.0 { most } else { 1.0 }
}

/// The values over `white` as a PNG of 16 bits; others than 0 to `white` are clipped.
fn png<const C: usize>(
    name: &'static str,
    planes: &Planes<C>,
    white: f32,
) -> Result<Vec<u8>, ImageError> {
    let colour = if C == 1 {
        ExtendedColorType::L16
    } else {
        ExtendedColorType::Rgb16
    };
    let all = planes.planes();
    let raw: Vec<u8> = (0..planes.extent().pixels())
        .flat_map(|at| all.map(|plane| plane[at]))
        .flat_map(|value| {
            (((value / white).clamp(0.0, 1.0) * 65535.0).round() as u16).to_ne_bytes()
        })
        .collect();
    let [width, height] = planes.extent().sides();
    let mut content = Vec::new();
    PngEncoder::new_with_quality(&mut content, CompressionType::Fast, FilterType::Adaptive)
        .write_image(&raw, width, height, colour)
        .map_err(damaged(name))?;
    Ok(content)
}
