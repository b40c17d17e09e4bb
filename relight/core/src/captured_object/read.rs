//! From bytes to a captured object, with limits.

use std::io::{Cursor, Read};
use std::path::Path;

use relit_data::still::stored_size;
use zip::ZipArchive;
use zip::result::ZipError;

use super::CapturedObject;
use super::manifest::{
    CAPTURED_OBJECT_SCHEMA, MANIFEST, Manifest, check_size, damaged, no_archive,
};
use crate::image::{Extent, ImageError, Planes, Rgb, StoredImage};
use crate::light::Normals;
use crate::render::{Gloss, Surface};

/// The longest `asset.json`, bytes.
const MAX_MANIFEST: u64 = 1 << 16;
/// The most bytes of a map beside those of its pixels.
const DECODER: u64 = 1 << 20;
/// Bytes of a map, at most, for each pixel: an incompressible image of four channels of 16 bits.
const BYTES_A_PIXEL: u64 = 9;

type Archive<'a> = ZipArchive<Cursor<&'a [u8]>>;

impl CapturedObject {
    /// Reads the content of a file. Bytes that are not a captured object are refused, and take no more memory than a file of
    /// the largest size allowed: 8192 pixels a side, 2^24 in total.
    ///
    /// # Errors
    /// If it is not a captured object that this version can read.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ImageError> {
        let length = bytes.len() as u64;
        if length > Self::MAX_BYTES {
            return Err(ImageError::Other(format!(
                "it has {length} bytes; the limit is {}",
                Self::MAX_BYTES
            )));
        }
        let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(no_archive)?;
        let manifest = manifest(&mut archive)?;
        let extent = Extent::new(manifest.width, manifest.height);
        check_size(extent)?;
        let mut maps = Maps {
            archive,
            extent,
            manifest,
        };
        let surface = Surface::new(maps.normals()?, Rgb::new(maps.albedo()?), maps.gloss()?)?;
        let alpha = maps.grey("alpha.png", 1.0)?;
        let confidence = maps.grey("confidence.png", 1.0)?;
        Self::new(maps.manifest.name, surface, alpha, confidence)
    }
}

fn manifest(archive: &mut Archive<'_>) -> Result<Manifest, ImageError> {
    let json = entry(archive, MANIFEST, MAX_MANIFEST)?;
    let schema: Schema = serde_json::from_slice(&json).map_err(damaged(MANIFEST))?;
    if schema.schema != CAPTURED_OBJECT_SCHEMA {
        let found: String = schema.schema.chars().take(80).collect();
        return Err(ImageError::Other(format!(
            "its schema is {found:?}, this version reads {CAPTURED_OBJECT_SCHEMA:?}: use a newer relight"
        )));
    }
    serde_json::from_slice(&json).map_err(damaged(MANIFEST))
}

/// The one field of `asset.json` that every version has.
#[derive(serde::Deserialize)]
struct Schema {
    schema: String,
}

/// The bytes of an entry, up to a limit.
fn entry(archive: &mut Archive<'_>, name: &'static str, most: u64) -> Result<Vec<u8>, ImageError> {
    let wrong = damaged::<String>(name);
    let entry = archive
        .by_name(name)
        .map_err(|source| wrong(source.to_string()))?;
    let mut content = Vec::new();
    let mut limited = entry.take(most + 1);
    limited
        .read_to_end(&mut content)
        .map_err(|source| wrong(source.to_string()))?;
    if content.len() as u64 > most {
        return Err(wrong(format!("more than {most} bytes")));
    }
    Ok(content)
}

/// The maps of an archive.
struct Maps<'a> {
    archive: Archive<'a>,
    extent: Extent,
    manifest: Manifest,
}

impl Maps<'_> {
    fn normals(&mut self) -> Result<Normals, ImageError> {
        Ok(Normals::from_colours(self.colours("normal.png", 1.0)?))
    }

    fn albedo(&mut self) -> Result<Planes<3>, ImageError> {
        let white = self.white("albedo")?;
        self.colours("albedo.png", white)
    }

    fn gloss(&mut self) -> Result<Option<Gloss>, ImageError> {
        if let Err(ZipError::FileNotFound) = self.archive.by_name("specular.png") {
            return Ok(None);
        }
        let white = self.white("specular")?;
        let reflectance = self.colours("specular.png", white)?;
        let white = self.white("smoothness")?;
        let smoothness = self.grey("smoothness.png", white)?;
        Ok(Some(Gloss::new(reflectance, smoothness)?))
    }

    /// The value that the largest number of a map stands for.
    fn white(&self, map: &'static str) -> Result<f32, ImageError> {
        let white = self.manifest.white.get(map).copied().unwrap_or(f32::NAN);
        if white.is_finite() && white >= 0.0 {
            return Ok(white);
        }
        let reason = format!("white.{map} is not a number from 0 up");
        Err(damaged(MANIFEST)(reason))
    }

    fn colours(&mut self, name: &'static str, white: f32) -> Result<Planes<3>, ImageError> {
        Ok(self.image(name)?.map(|value| value * white))
    }

    fn grey(&mut self, name: &'static str, white: f32) -> Result<Planes<1>, ImageError> {
        let [values, ..] = self.colours(name, white)?.into_planes();
        Planes::from_planes(self.extent, [values])
    }

    fn image(&mut self, name: &'static str) -> Result<Planes<3>, ImageError> {
        let most = BYTES_A_PIXEL * self.extent.pixels() as u64 + DECODER;
        let content = entry(&mut self.archive, name, most)?;
        let (width, height) = stored_size(&content).unwrap_or_default();
        if [width, height] != self.extent.sides() {
            return Err(damaged(name)(format!("{width} x {height} pixels")));
        }
        Ok(StoredImage::from_bytes(Path::new(name), &content)?.planes)
    }
}
