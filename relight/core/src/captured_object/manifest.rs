//! `asset.json`, the entry that describes the others, and the sizes that there can be.

use std::collections::BTreeMap;
use std::fmt::Display;

use serde::{Deserialize, Serialize};
use zip::result::ZipError;

use crate::image::{Extent, ImageError};

/// The file's schema.
pub const CAPTURED_OBJECT_SCHEMA: &str = "relight.asset/1";
/// The entry that describes the others.
pub(super) const MANIFEST: &str = "asset.json";
/// The longest side of an object, pixels.
const MAX_SIDE: usize = 8192;
/// The most pixels of an object.
const MAX_PIXELS: usize = 1 << 24;

/// `asset.json`.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Manifest {
    pub(super) schema: String,
    #[serde(default)]
    pub(super) software: String,
    pub(super) name: String,
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) white: BTreeMap<String, f32>,
}

/// For a closure that knows why an entry is of no use.
pub(super) fn damaged<E: Display>(entry: &'static str) -> impl Fn(E) -> ImageError {
    move |reason| ImageError::Other(format!("its entry {entry} is missing or damaged: {reason}"))
}

/// For bytes that are not an archive.
pub(super) fn no_archive(fault: ZipError) -> ImageError {
    ImageError::Other(format!("it is not a ZIP archive, or is damaged: {fault}"))
}

/// Refuses sizes beyond the limits of the format.
pub(super) fn check_size(extent: Extent) -> Result<(), ImageError> {
    let Extent { width, height } = extent;
    let sides = 1..=MAX_SIDE;
    if sides.contains(&width) && sides.contains(&height) && width * height <= MAX_PIXELS {
        return Ok(());
    }
    Err(ImageError::Other(format!(
        "{width} x {height} pixels: the limits are 1 to {MAX_SIDE} a side and {MAX_PIXELS} in total"
    )))
}
