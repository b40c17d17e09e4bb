//! From bytes to a captured object, with limits.

use std::io::{Cursor, Read};

use image::{DynamicImage, ImageFormat, ImageReader, Limits};
use zip::ZipArchive;
use zip::result::ZipError;

use super::CapturedObject;
use super::manifest::{
    CAPTURED_OBJECT_SCHEMA, MANIFEST, Manifest, check_size, damaged, no_archive,
};
use crate::image::{Extent, ImageError, Planes, Rgb};
use crate::light::{Normals, YUp};
use crate::render::{Gloss, Surface};

/// The longest `asset.json`, bytes.
const MAX_MANIFEST: u64 = 1 << 16;
/// The most bytes that decoding a map may take besides the map itself.
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
    fn normals(&mut self) -> Result<Normals<YUp>, ImageError> {
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
        let image = self.image(name)?.into_rgb16();
        let channel = |channel: usize| -> Vec<f32> {
            let pixels = image.as_raw().chunks_exact(3);
            pixels.map(|pixel| value(pixel[channel], white)).collect()
        };
        Ok(Planes::from_planes(self.extent, [0, 1, 2].map(channel))?)
    }

    fn grey(&mut self, name: &'static str, white: f32) -> Result<Planes<1>, ImageError> {
        let image = self.image(name)?.into_luma16();
        let values = image.as_raw().iter().map(|&raw| value(raw, white));
        Ok(Planes::from_planes(self.extent, [values.collect()])?)
    }

    fn image(&mut self, name: &'static str) -> Result<DynamicImage, ImageError> {
        let pixels = self.extent.pixels() as u64;
        let content = entry(&mut self.archive, name, BYTES_A_PIXEL * pixels + DECODER)?;
        let wrong = damaged(name);
        let mut limits = Limits::default();
        limits.max_image_width = u32::try_from(self.extent.width).ok();
        limits.max_image_height = u32::try_from(self.extent.height).ok();
        limits.max_alloc = Some(BYTES_A_PIXEL * pixels + DECODER);
        let mut reader = ImageReader::with_format(Cursor::new(content), ImageFormat::Png);
        reader.limits(limits);
        let image = reader.decode().map_err(wrong)?;
        let found = Extent::new(image.width() as usize, image.height() as usize);
        if found != self.extent {
            let reason = format!("{} x {} pixels", found.width, found.height);
            return Err(damaged(name)(reason));
        }
        Ok(image)
    }
}

fn value(raw: u16, white: f32) -> f32 {
    f32::from(raw) / 65535.0 * white
}
