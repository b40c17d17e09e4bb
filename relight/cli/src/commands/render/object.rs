//! An object that is lit: its maps, from files or as one value each, or a captured object.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Args;
use relight_core::files::read_planes;
use relight_core::image::{
    Extent, ImageError, Linear, Planes, Rgb, Samples, StoredImage, Transfer, check_extent,
};
use relight_core::light::{Normals, NormalsFrame};
use relight_core::render::{Gloss, Surface};
use relight_photo::export::{object_files, read_object};
use relit_console::Console;

use crate::inputs::{NormalsArgument, TransferArgument};

/// A map from a file, or one value for all pixels.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Map {
    /// The file.
    File(PathBuf),
    /// Linear values.
    Even([f32; 3]),
}

#[derive(Args)]
pub(super) struct ObjectArguments {
    /// An object in place of maps: object.relit, or a folder of relight turn or relight decompose.
    #[arg(value_name = "OBJECT", help_heading = None::<&'static str>, conflicts_with_all = ["normals", "mask", "albedo", "reflectance", "smoothness"])]
    object: Option<PathBuf>,
    /// Normals, x to the right, z to the viewer: a PNG of (n + 1) / 2, black outside, or an EXR of vectors.
    #[arg(long, value_name = "FILE", required_unless_present = "object")]
    normals: Option<PathBuf>,
    #[command(flatten)]
    normals_frame: NormalsArgument,
    /// A grey image, at least one half on the object [default: where normals are].
    #[arg(long, value_name = "FILE")]
    mask: Option<PathBuf>,
    /// Albedo: a file, or one or three linear values (0.8, or 0.8,0.5,0.3).
    #[arg(long, value_name = "FILE|VALUE", default_value = "0.8", value_parser = map)]
    albedo: Map,
    /// Specular reflectance s_p: a file, or one or three linear values [default: none, diffuse].
    #[arg(long, value_name = "FILE|VALUE", value_parser = map)]
    reflectance: Option<Map>,
    /// Smoothness α: a value, an EXR, or an 8-bit PNG of values 0 to 255.
    #[arg(long, value_name = "FILE|VALUE", default_value = "50", value_parser = map)]
    pub(super) smoothness: Map,
    #[command(flatten)]
    encoding: TransferArgument,
}

impl ObjectArguments {
    /// What is read.
    pub(super) fn inputs(&self) -> Vec<PathBuf> {
        let object = self.object.iter().flat_map(|path| object_files(path));
        let files = self.normals.iter().chain(&self.mask).cloned();
        let maps = [
            Some(&self.albedo),
            Some(&self.smoothness),
            self.reflectance.as_ref(),
        ];
        let maps = maps.into_iter().flatten().filter_map(|map| match map {
            Map::File(path) => Some(path.clone()),
            Map::Even(_) => None,
        });
        object.chain(files).chain(maps).collect()
    }

    /// Reads the object.
    ///
    /// # Errors
    /// If a file cannot be read, the maps differ in size, a map has a value that is negative or not
    /// finite, or no pixel shows the object.
    pub(super) fn read(&self, console: Console) -> Result<Surface, Box<dyn Error>> {
        if let Some(path) = &self.object {
            return Ok(read_object(path)?.surface().clone());
        }
        let normals = self.read_normals(console)?;
        let extent = normals.extent();
        let albedo = self.read_colour("albedo", &self.albedo, extent)?;
        let gloss = match &self.reflectance {
            None => None,
            Some(map) => {
                let reflectance = self.read_colour("reflectance", map, extent)?.into_planes();
                Some(Gloss::new(reflectance, self.read_smoothness(extent)?)?)
            }
        };
        Ok(Surface::new(normals, albedo, gloss)?)
    }

    fn read_normals(&self, console: Console) -> Result<Normals, Box<dyn Error>> {
        let Some(path) = &self.normals else {
            return Err(
                "give an object (object.relit, or a folder of relight turn or relight decompose), or --normals".into(),
            );
        };
        let normals = match self.normals_frame.normals_y {
            NormalsFrame::YUp => Normals::read(path)?,
            NormalsFrame::YDown => Normals::read(path)?.flipped(),
        };
        let normals = match &self.mask {
            None => normals,
            Some(path) => {
                let image = StoredImage::read(path)?;
                check_extent("mask", image.planes.extent(), normals.extent())?;
                let (mask, note) = image.object_mask(path)?;
                if let Some(note) = note {
                    console.warn(&format!("{}: {note}", path.display()));
                }
                normals.masked(&mask)?
            }
        };
        if normals.is_empty() {
            let path = path.display();
            return Err(
                format!("{path} has no normals inside the mask: give another map or mask").into(),
            );
        }
        Ok(normals)
    }

    fn read_colour(
        &self,
        what: &'static str,
        map: &Map,
        extent: Extent,
    ) -> Result<Rgb<Linear>, ImageError> {
        match map {
            Map::File(path) => {
                let transfer = self.encoding.transfer.unwrap_or(Transfer::Srgb);
                let colours = Rgb::<Linear>::read(path, transfer)?;
                check_values(path, what, colours.planes())?;
                Ok(colours)
            }
            Map::Even(value) => Ok(Rgb::new(Planes::filled(extent, *value))),
        }
    }

    fn read_smoothness(&self, extent: Extent) -> Result<Planes<1>, ImageError> {
        match &self.smoothness {
            Map::Even([value, ..]) => Ok(Planes::filled(extent, [*value])),
            Map::File(path) => {
                let (planes, samples) = read_planes(path)?;
                check_values(path, "smoothness", &planes)?;
                let scale = match samples {
                    Samples::Integer => 255.0,
                    Samples::Float => 1.0,
                };
                let [values, ..] = planes.into_planes();
                Ok(Planes::from_planes(extent, [values])?.map(|value| value * scale))
            }
        }
    }
}

/// Whether all values are finite and not negative.
fn check_values(path: &Path, what: &'static str, planes: &Planes<3>) -> Result<(), ImageError> {
    let mut values = planes.planes().into_iter().flatten();
    if values.all(|value| value.is_finite() && *value >= 0.0) {
        return Ok(());
    }
    Err(ImageError::file(
        path,
        format!(
            "is not a map of {what}: it has a value that is negative, infinite or not a number"
        ),
    ))
}

/// One number, three numbers separated by commas, or else a file.
fn map(text: &str) -> Result<Map, String> {
    let numbers: Result<Vec<f32>, _> = text.split(',').map(str::parse).collect();
    match numbers.as_deref() {
        Err(_) => Ok(Map::File(text.into())),
        Ok(&[value]) if is_value(value) => Ok(Map::Even([value; 3])),
        Ok(&[r, g, b]) if [r, g, b].into_iter().all(is_value) => Ok(Map::Even([r, g, b])),
        Ok(_) => Err("give a file, or one or three numbers from 0 up".to_owned()),
    }
}

fn is_value(number: f32) -> bool {
    number.is_finite() && number >= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::files::{write_exr, write_png};
    use relight_core::image::Depth;

    fn files(folder: &Path) -> ObjectArguments {
        let extent = Extent::new(4, 2);
        let write = |name: &str, value: [f32; 3]| {
            let path = folder.join(name);
            write_png(&path, &Planes::filled(extent, value), Depth::Eight).unwrap();
            path
        };
        let normals = Normals::new(Planes::filled(extent, [0.0, 0.6, 0.8]));
        let path = folder.join("normal.png");
        normals.write_png(&path, Depth::Sixteen).unwrap();
        ObjectArguments {
            object: None,
            normals: Some(path),
            normals_frame: NormalsArgument {
                normals_y: NormalsFrame::YDown,
            },
            mask: None,
            albedo: Map::File(write("albedo.png", [0.5; 3])),
            reflectance: Some(Map::Even([0.1, 0.2, 0.3])),
            smoothness: Map::File(write("smoothness.png", [40.0 / 255.0; 3])),
            encoding: TransferArgument { transfer: None },
        }
    }

    #[test]
    fn maps_are_read_in_the_frame_and_encoding_that_are_stated() {
        let folder = tempfile::tempdir().unwrap();
        let surface = files(folder.path()).read(Console::new(false)).unwrap();
        let [x, y, z] = surface.normals().planes().pixel(0, 0);
        assert!(x.abs() < 1e-4 && (y + 0.6).abs() < 1e-4 && (z - 0.8).abs() < 1e-4);
        assert!((surface.albedo().planes().pixel(0, 0)[0] - 0.2159).abs() < 1e-3);
        let gloss = surface.gloss().unwrap();
        assert!((gloss.smoothness().pixel(3, 1)[0] - 40.0).abs() < 1e-4);
        assert_eq!(gloss.reflectance().pixel(3, 1), [0.1, 0.2, 0.3]);
    }

    #[test]
    fn an_exr_of_smoothness_is_taken_as_it_stands() {
        let folder = tempfile::tempdir().unwrap();
        let mut files = files(folder.path());
        let path = folder.path().join("smoothness.exr");
        write_exr(&path, &Planes::filled(Extent::new(4, 2), [333.0; 3])).unwrap();
        files.smoothness = Map::File(path);
        let surface = files.read(Console::new(false)).unwrap();
        assert_eq!(surface.gloss().unwrap().smoothness().pixel(1, 1), [333.0]);
    }

    #[test]
    fn maps_with_values_that_cannot_be_are_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("strange.exr");
        for value in [f32::NAN, f32::INFINITY, -0.5] {
            write_exr(&path, &Planes::filled(Extent::new(4, 2), [0.5, value, 0.5])).unwrap();
            for what in ["albedo", "reflectance", "smoothness"] {
                let mut files = files(folder.path());
                match what {
                    "albedo" => files.albedo = Map::File(path.clone()),
                    "reflectance" => files.reflectance = Some(Map::File(path.clone())),
                    _ => files.smoothness = Map::File(path.clone()),
                }
                let error = files.read(Console::new(false)).unwrap_err().to_string();
                assert!(
                    error.contains("strange.exr") && error.contains(what),
                    "{error}"
                );
            }
        }
    }

    #[test]
    fn outside_the_mask_there_is_no_surface() {
        let folder = tempfile::tempdir().unwrap();
        let mut files = files(folder.path());
        let path = folder.path().join("mask.png");
        let mask = Planes::from_fn(Extent::new(4, 2), |x, _| [[0.0; 3], [1.0; 3]][x % 2]);
        write_png(&path, &mask, Depth::Eight).unwrap();
        files.mask = Some(path);
        let surface = files.read(Console::new(false)).unwrap();
        assert_eq!(surface.normals().planes().pixel(0, 0), [0.0; 3]);
        assert_ne!(surface.normals().planes().pixel(1, 0), [0.0; 3]);
    }

    #[test]
    fn a_mask_that_marks_nothing_is_refused_with_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let mut files = files(folder.path());
        let path = folder.path().join("mask.png");
        write_png(&path, &Planes::zeros(Extent::new(4, 2)), Depth::Eight).unwrap();
        files.mask = Some(path.clone());
        let error = files.read(Console::new(false)).unwrap_err().to_string();
        assert!(error.contains("mask.png"), "{error}");
    }

    #[test]
    fn a_mask_of_another_size_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let mut files = files(folder.path());
        let path = folder.path().join("mask.png");
        write_png(&path, &Planes::zeros(Extent::new(5, 2)), Depth::Eight).unwrap();
        files.mask = Some(path);
        let error = files.read(Console::new(false)).unwrap_err().to_string();
        assert!(
            error.contains("5 x 2") && error.contains("4 x 2"),
            "{error}"
        );
    }
}
