//! An object out of `object.relit`, or a folder of `relight turn` or `relight decompose`.

use std::fs;
use std::path::{Path, PathBuf};

use relight_core::captured_object::CapturedObject;
use relight_core::files::read_planes;
use relight_core::image::{ImageError, Planes, Rgb, Transfer};
use relight_core::light::Normals;
use relight_core::render::{Gloss, Surface};
use serde::Deserialize;

/// The figures of a decomposition, and those of a turn.
const FIGURES: [&str; 2] = ["decomposition.json", "turn.json"];

/// The maps in a folder.
const MASK: &str = "mask.png";
const NORMALS: &str = "normal.png";
const ALBEDO: &str = "albedo.png";
const CONFIDENCE: &str = "confidence.png";

/// The figures that the maps do not have.
#[derive(Deserialize)]
struct MapFigures {
    white: MapWhites,
    #[serde(default)]
    specular: Option<EvenGloss>,
    #[serde(default)]
    gloss: Option<EvenGloss>,
}

#[derive(Deserialize)]
struct MapWhites {
    albedo: f32,
}

/// The gloss of a whole object.
#[derive(Deserialize)]
struct EvenGloss {
    reflectance: Option<f32>,
    smoothness: Option<f32>,
}

/// Whether a path is called as a captured object, or is a folder with one or with the maps of a decomposition or a turn.
#[must_use]
pub fn is_object(path: &Path) -> bool {
    CapturedObject::is_named(path) || figures_in(path).is_some()
}

/// The name of the figures that a folder has with its maps.
fn figures_in(folder: &Path) -> Option<&'static str> {
    FIGURES.into_iter().find(|name| folder.join(name).is_file())
}

/// Reads an object: a file `*.relit`, or a folder with `object.relit` or with the maps of a decomposition or a turn.
///
/// # Errors
/// If it holds no object, or if a file cannot be read.
pub fn read_object(path: &Path) -> Result<CapturedObject, ImageError> {
    if !path.exists() {
        return Err(ImageError::file(
            path,
            "does not exist: give object.relit, or a folder that relight turn or relight decompose has written",
        ));
    }
    if path.is_file() || path.join(CapturedObject::FILE).is_file() {
        return CapturedObject::read(path);
    }
    let Some(figures) = figures_in(path) else {
        return Err(ImageError::file(
            path,
            "holds no object: give object.relit, or a folder that relight turn or relight decompose has written",
        ));
    };
    read_maps(path, figures)
}

/// The files that [`read_object`] may read.
#[must_use]
pub fn object_files(path: &Path) -> Vec<PathBuf> {
    if path.is_dir() {
        let names = [MASK, NORMALS, ALBEDO, CONFIDENCE, CapturedObject::FILE];
        names.map(|name| path.join(name)).to_vec()
    } else {
        vec![path.to_owned()]
    }
}

fn read_maps(folder: &Path, figures: &str) -> Result<CapturedObject, ImageError> {
    let file = folder.join(figures);
    let wrong = |reason: String| ImageError::file(&file, format!("cannot be read: {reason}"));
    let json = fs::read(&file).map_err(|error| wrong(error.to_string()))?;
    let figures: MapFigures =
        serde_json::from_slice(&json).map_err(|error| wrong(error.to_string()))?;
    let white = figures.white.albedo;
    if !(white.is_finite() && white >= 0.0) {
        return Err(wrong("white.albedo is not a number from 0 up".to_owned()));
    }
    let (mask, _) = read_planes(&folder.join(MASK))?;
    let alpha = Planes::from_planes(mask.extent(), [mask.plane(0).to_vec()])?;
    let normals = Normals::read(&folder.join(NORMALS))?;
    let albedo = Rgb::read(&folder.join(ALBEDO), Transfer::Srgb)?;
    let albedo = Rgb::new(albedo.into_planes().map(|value| value * white));
    let extent = normals.extent();
    let gloss = figures
        .gloss
        .or(figures.specular)
        .and_then(|gloss| Some((gloss.reflectance?, gloss.smoothness?)))
        .map(|(reflectance, smoothness)| Gloss::even(extent, [reflectance; 3], smoothness));
    let confidence = folder.join(CONFIDENCE);
    // Only turns have one.
    let confidence = if confidence.exists() {
        let (map, _) = read_planes(&confidence)?;
        Planes::from_planes(map.extent(), [map.plane(0).to_vec()])?
    } else {
        Planes::filled(extent, [1.0])
    };
    let name = folder
        .file_name()
        .map_or_else(|| "object".to_owned(), |n| n.to_string_lossy().into_owned());
    let surface = Surface::new(normals, albedo, gloss)?;
    CapturedObject::new(name, surface, alpha, confidence)
}
