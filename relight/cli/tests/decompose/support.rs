//! Photographs, masks and folders of the tests.

use std::fs;
use std::path::{Path, PathBuf};

use image::{GrayImage, Luma, Rgb as Pixel, RgbImage};
use relight_photo::decompose::{
    DecomposeError, DecomposeOptions, Decomposer, Decomposition, Photo, SpecularGate,
};
use relight_photo::files::{DecompositionFiles, PhotoInput, PhotoReading};
use relight_photo::nets::{Weights, decomposer};

pub(crate) const WIDTH: u32 = 60;
pub(crate) const HEIGHT: u32 = 48;

pub(crate) fn untrained() -> Decomposer {
    Decomposer::with_side(&Weights::initial(&decomposer(), 3), 32).unwrap()
}

pub(crate) fn is_inside(x: u32, y: u32) -> bool {
    let distance = (f64::from(x) - 30.0).hypot(f64::from(y) - 24.0);
    distance < 20.0
}

/// An object before a background of this grey.
pub(crate) fn object(background: u8) -> RgbImage {
    RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
        if is_inside(x, y) {
            Pixel([120 + x as u8, 100, 60 + 2 * y as u8])
        } else {
            Pixel([background; 3])
        }
    })
}

pub(crate) fn mask() -> GrayImage {
    GrayImage::from_fn(WIDTH, HEIGHT, |x, y| {
        Luma([if is_inside(x, y) { 255 } else { 0 }])
    })
}

pub(crate) fn load(path: &Path, reading: &PhotoReading) -> Result<Photo, DecomposeError> {
    PhotoInput {
        path: path.to_owned(),
    }
    .load(reading)
}

pub(crate) fn with_mask(path: PathBuf) -> PhotoReading {
    PhotoReading {
        mask: Some(path),
        ..PhotoReading::default()
    }
}

pub(crate) struct Folder(pub(crate) tempfile::TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Saves an image, and its path.
    pub(crate) fn save(&self, name: &str, save: impl FnOnce(&Path)) -> PathBuf {
        let path = self.path(name);
        save(&path);
        path
    }
}

pub(crate) fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

pub(crate) fn decomposed(
    photo: &Photo,
    specular: SpecularGate,
) -> (Decomposition, DecomposeOptions) {
    let options = photo.options(&DecomposeOptions {
        specular,
        ..DecomposeOptions::default()
    });
    let found = untrained().decompose(&photo.picture, &photo.mask, &options);
    (found.unwrap(), options)
}

pub(crate) fn write(photo: &Photo, out: &Path) -> Result<Decomposition, DecomposeError> {
    let (found, options) = decomposed(photo, SpecularGate::On);
    let files = DecompositionFiles {
        photo,
        found: &found,
        options: &options,
        weights: "untrained",
    };
    files.write(out)?;
    Ok(found)
}
