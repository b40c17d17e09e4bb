//! A captured object in one file, ready to be lit: `object.relit`.
//!
//! An [`Asset`] is the maps of an object as it was seen from one side: how far each pixel is covered, normals,
//! albedo, gloss where it has any, and how far each normal is to be believed. The module knows nothing of where they come
//! from, nor of what is done with them.
//!
//! The file is a ZIP archive whose entries are stored without compression, so that any program can open it:
//!
//! | entry | content |
//! | --- | --- |
//! | `asset.json` | schema `relight.asset/1`, name, width and height, and the value `white` that the largest number of a map stands for |
//! | `alpha.png` | 16-bit grey: the part of the pixel that the object covers |
//! | `normal.png` | 16 bits, (n + 1) / 2, x to the right, y up, z to the viewer; black where there is none |
//! | `albedo.png` | 16 bits, linear, over `white.albedo`: the object's own colour, also in pixels that it covers in part |
//! | `specular.png`, `smoothness.png` | s_p, 16 bits, linear, over `white.specular`; α, 16-bit grey, over `white.smoothness`. Both are there or none |
//! | `confidence.png` | 16-bit grey: 0 to 1 |
//!
//! Readers ignore entries and fields that they do not know. A change that an older reader would misunderstand raises
//! the number in the schema.

mod error;
mod read;
mod write;

#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

use crate::image::{Extent, ImageError, Planes};
use crate::render::Surface;

pub use error::AssetError;

/// What the file says it is.
pub const ASSET_SCHEMA: &str = "relight.asset/1";
/// The entry that describes the others.
const MANIFEST: &str = "asset.json";
/// The longest side of an asset, pixels.
const MOST_SIDE: usize = 8192;
/// The most pixels of an asset.
const MOST_PIXELS: usize = 1 << 24;

/// An object that can be lit.
///
/// ```
/// use relight_core::asset::Asset;
/// use relight_core::image::{Planes, Rgb};
/// use relight_core::light::Normals;
/// use relight_core::render::Surface;
///
/// let normals = Normals::sphere(9);
/// let extent = normals.extent();
/// let albedo = Rgb::new(Planes::filled(extent, [0.5, 0.4, 0.3]));
/// let full = Planes::filled(extent, [1.0]);
/// let ball = Asset::new("ball", Surface::new(normals, albedo, None)?, full.clone(), full)?;
/// let back = Asset::from_bytes(&ball.to_bytes()?)?;
/// assert_eq!(back.name(), "ball");
/// assert!((back.surface().albedo().planes().pixel(4, 4)[1] - 0.4).abs() < 1e-4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Asset {
    name: String,
    surface: Surface,
    alpha: Planes<1>,
    confidence: Planes<1>,
}

/// `asset.json`.
#[derive(Debug, Serialize, Deserialize)]
struct Manifest {
    schema: String,
    #[serde(default)]
    software: String,
    name: String,
    width: usize,
    height: usize,
    white: BTreeMap<String, f32>,
}

impl Asset {
    /// The largest file that is read, bytes.
    pub const MOST_BYTES: u64 = 1 << 29;

    /// An object of these maps. Coverage and confidence are brought to 0 to 1, what is not a number to 0.
    ///
    /// # Errors
    /// Where they differ in size, or are too large for a file.
    pub fn new(
        name: impl Into<String>,
        surface: Surface,
        alpha: Planes<1>,
        confidence: Planes<1>,
    ) -> Result<Self, AssetError> {
        let extent = surface.extent();
        check_size(extent)?;
        for (what, map) in [
            ("map of coverage", &alpha),
            ("map of confidence", &confidence),
        ] {
            if map.extent() != extent {
                return Err(AssetError::Image(ImageError::Extent {
                    what,
                    found: map.extent(),
                    expected: extent,
                }));
            }
        }
        let part = |value: f32| if value > 0.0 { value.min(1.0) } else { 0.0 };
        Ok(Self {
            name: name.into(),
            surface,
            alpha: alpha.map(part),
            confidence: confidence.map(part),
        })
    }

    /// Reads the content of a file. Bytes that are no asset are refused and need no more memory than a file of
    /// the largest size that is allowed: 8192 pixels a side, 2^24 in all.
    ///
    /// # Errors
    /// Where it is no asset that this program knows.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, AssetError> {
        read::bytes(bytes)
    }

    /// The content of a file.
    ///
    /// # Errors
    /// Where a map cannot be encoded.
    pub fn to_bytes(&self) -> Result<Vec<u8>, AssetError> {
        write::bytes(self)
    }

    /// What it is called.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Normals, albedo and gloss.
    #[must_use]
    pub const fn surface(&self) -> &Surface {
        &self.surface
    }

    /// The part of each pixel that the object covers, 0 to 1. Colours are not multiplied with it.
    #[must_use]
    pub const fn alpha(&self) -> &Planes<1> {
        &self.alpha
    }

    /// How far each normal is to be believed, 0 to 1.
    #[must_use]
    pub const fn confidence(&self) -> &Planes<1> {
        &self.confidence
    }

    /// Width and height.
    #[must_use]
    pub const fn extent(&self) -> Extent {
        self.surface.extent()
    }
}

fn check_size(extent: Extent) -> Result<(), AssetError> {
    let Extent { width, height } = extent;
    let sides = 1..=MOST_SIDE;
    if sides.contains(&width) && sides.contains(&height) && width * height <= MOST_PIXELS {
        return Ok(());
    }
    Err(AssetError::Size { extent })
}
