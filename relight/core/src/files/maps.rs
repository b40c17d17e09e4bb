//! The files that hold an object's maps.

use std::path::{Path, PathBuf};

use super::read_planes;
use crate::image::{
    Extent, ImageError, Linear, Planes, Rgb, Samples, StoredImage, Transfer, check_extent,
};
use crate::light::{Normals, NormalsFrame, YDown, YUp};
use crate::render::{Gloss, Surface};

/// A map from a file, or one value for all pixels.
#[derive(Debug, Clone, PartialEq)]
pub enum Map {
    /// The file.
    File(PathBuf),
    /// Linear values.
    Even([f32; 3]),
}

/// Where an object's maps are, and how they are encoded.
#[derive(Debug, Clone, PartialEq)]
pub struct MapFiles {
    /// PNG of colours (n + 1) / 2, or EXR of vectors; black is no surface.
    pub normals: PathBuf,
    /// Which way y points in it.
    pub frame: NormalsFrame,
    /// A grey image; below one half there is no surface either.
    pub mask: Option<PathBuf>,
    /// The diffuse reflectance A.
    pub albedo: Map,
    /// The specular reflectance s_p; without it the object is diffuse.
    pub reflectance: Option<Map>,
    /// The smoothness α. The 8-bit values of a PNG are α itself (0 to 255), as are those of an EXR.
    pub smoothness: Map,
    /// How integers in the files of albedo and specular reflectance are encoded.
    pub transfer: Transfer,
}

impl MapFiles {
    /// Reads the object.
    ///
    /// # Errors
    /// Where a file cannot be read, the maps differ in size, a map has a value that is negative or not
    /// finite, or there is no surface.
    pub fn read(&self) -> Result<Surface, ImageError> {
        let normals = self.read_normals()?;
        let extent = normals.extent();
        let albedo = self.read_colour("albedo", &self.albedo, extent)?;
        let gloss = match &self.reflectance {
            None => None,
            Some(map) => {
                let reflectance = self.read_colour("reflectance", map, extent)?.into_planes();
                Some(Gloss::new(reflectance, self.read_smoothness(extent)?)?)
            }
        };
        Surface::new(normals, albedo, gloss)
    }

    fn read_normals(&self) -> Result<Normals<YUp>, ImageError> {
        let normals = match self.frame {
            NormalsFrame::YUp => Normals::<YUp>::read(&self.normals)?,
            NormalsFrame::YDown => Normals::<YDown>::read(&self.normals)?.flipped(),
        };
        let normals = match &self.mask {
            None => normals,
            Some(path) => {
                let image = StoredImage::read(path)?;
                check_extent("mask", image.planes.extent(), normals.extent())?;
                normals.masked(&image.object_mask(path)?.0)?
            }
        };
        if normals.is_empty() {
            return Err(ImageError::Form {
                path: self.normals.clone(),
                fault: "shows no surface: it has no normals, or none inside the mask".to_owned(),
            });
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
                let colours = Rgb::<Linear>::read(path, self.transfer)?;
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
                Ok(first_channel(planes)?.map(|value| value * scale))
            }
        }
    }
}

/// Whether no value is negative or not finite.
fn check_values(path: &Path, what: &'static str, planes: &Planes<3>) -> Result<(), ImageError> {
    let mut values = planes.planes().into_iter().flatten();
    if values.all(|value| value.is_finite() && *value >= 0.0) {
        return Ok(());
    }
    Err(ImageError::Form {
        path: path.to_owned(),
        fault: format!(
            "is no map of {what}: it has a value that is negative, infinite or not a number"
        ),
    })
}

fn first_channel(planes: Planes<3>) -> Result<Planes<1>, ImageError> {
    let extent = planes.extent();
    let [values, ..] = planes.into_planes();
    Planes::from_planes(extent, [values])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::{write_exr, write_png};
    use crate::image::Depth;

    fn files(folder: &Path) -> MapFiles {
        let extent = Extent::new(4, 2);
        let write = |name: &str, value: [f32; 3]| {
            let path = folder.join(name);
            write_png(&path, &Planes::filled(extent, value), Depth::Eight).unwrap();
            path
        };
        let normals = Normals::<YDown>::new(Planes::filled(extent, [0.0, 0.6, 0.8]));
        let path = folder.join("normal.png");
        normals.write_png(&path, Depth::Sixteen).unwrap();
        MapFiles {
            normals: path,
            frame: NormalsFrame::YDown,
            mask: None,
            albedo: Map::File(write("albedo.png", [0.5; 3])),
            reflectance: Some(Map::Even([0.1, 0.2, 0.3])),
            smoothness: Map::File(write("smoothness.png", [40.0 / 255.0; 3])),
            transfer: Transfer::Srgb,
        }
    }

    #[test]
    fn maps_are_read_in_the_frame_and_encoding_that_are_stated() {
        let folder = tempfile::tempdir().unwrap();
        let surface = files(folder.path()).read().unwrap();
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
        let surface = files.read().unwrap();
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
                let error = files.read().unwrap_err().to_string();
                let expected = format!("strange.exr is no map of {what}");
                assert!(error.contains(&expected), "{error}");
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
        let surface = files.read().unwrap();
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
        let error = files.read().unwrap_err();
        assert!(
            matches!(&error, ImageError::NotAMask { path: named, .. } if *named == path),
            "{error}"
        );
    }

    #[test]
    fn a_mask_of_another_size_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let mut files = files(folder.path());
        let path = folder.path().join("mask.png");
        write_png(&path, &Planes::zeros(Extent::new(5, 2)), Depth::Eight).unwrap();
        files.mask = Some(path);
        let error = files.read().unwrap_err().to_string();
        assert_eq!(error, "the mask has 5 x 2 pixels where 4 x 2 are needed");
    }
}
