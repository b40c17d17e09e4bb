//! Folders of predictions.

use std::path::PathBuf;

use super::EvalError;
use relight_core::files::read_planes;
use relight_core::image::{Extent, Linear, Planes, Rgb, Samples, Transfer};
use relight_core::light::NormalsFrame;
use relight_core::light::{Normals, ShLight, YDown, YUp};
use relight_core::render::{Gloss, Surface};

/// A folder with a folder for each image of the ground truth, of the same name, in which the estimates lie:
/// `albedo`, `shading`, `highlight` (or `specular`), `normal` as `.exr` (linear, or vectors) or `.png` (8 or 16
/// bits), `light.txt` as lines of red, green and blue coefficients.
#[derive(Debug, Clone)]
pub struct Predictions {
    root: PathBuf,
    transfer: Transfer,
    frame: NormalsFrame,
}

impl Predictions {
    /// The predictions in the folder `root`, of which PNGs hold colours by `transfer`.
    #[must_use]
    pub const fn new(root: PathBuf, transfer: Transfer, frame: NormalsFrame) -> Self {
        Self {
            root,
            transfer,
            frame,
        }
    }

    /// How a table names them: the folder's name.
    #[must_use]
    pub fn name(&self) -> String {
        let name = self.root.file_name().unwrap_or(self.root.as_os_str());
        name.to_string_lossy().into_owned()
    }

    /// The predicted image `part` of the sample `name`.
    pub(super) fn colour(
        &self,
        name: &str,
        part: &'static str,
        extent: Extent,
    ) -> Result<Rgb<Linear>, EvalError> {
        let path = self.find(name, part)?;
        let image = Rgb::read(&path, self.transfer)?;
        check_size(path, image.planes().extent(), extent)?;
        Ok(image)
    }

    /// The predicted normals of the sample `name`.
    pub(super) fn normals(&self, name: &str, extent: Extent) -> Result<Normals<YUp>, EvalError> {
        let path = self.find(name, "normal")?;
        let normals = match self.frame {
            NormalsFrame::YUp => Normals::<YUp>::read(&path)?,
            NormalsFrame::YDown => Normals::<YDown>::read(&path)?.flipped(),
        };
        check_size(path, normals.extent(), extent)?;
        Ok(normals)
    }

    /// The predicted light of the sample `name`.
    pub(super) fn light(&self, name: &str) -> Result<ShLight, EvalError> {
        let path = self.file(name, "light.txt");
        let text = std::fs::read_to_string(&path).map_err(|source| EvalError::Read {
            path: path.clone(),
            source,
        })?;
        text.parse()
            .map_err(|source| EvalError::Light { path, source })
    }

    /// The predicted maps of the object `name`; none where there is no map of normals.
    pub(super) fn surface(&self, name: &str, extent: Extent) -> Result<Option<Surface>, EvalError> {
        if self.existing(name, "normal").is_none() {
            return Ok(None);
        }
        let normals = self.normals(name, extent)?;
        let albedo = self.colour(name, "albedo", extent)?;
        let gloss = match self.existing(name, "reflectance") {
            None => None,
            Some(_) => {
                let reflectance = self.colour(name, "reflectance", extent)?;
                let smoothness = self.smoothness(name, extent)?;
                Some(Gloss::new(reflectance.into_planes(), smoothness)?)
            }
        };
        Ok(Some(Surface::new(normals, albedo, gloss)?))
    }

    /// The predicted smoothness: the values of an EXR, or those of an 8-bit PNG, 0..=255.
    fn smoothness(&self, name: &str, extent: Extent) -> Result<Planes<1>, EvalError> {
        let path = self.find(name, "smoothness")?;
        let (planes, samples) = read_planes(&path)?;
        check_size(path, planes.extent(), extent)?;
        let scale = match samples {
            Samples::Integer => 255.0,
            Samples::Float => 1.0,
        };
        let [values, ..] = planes.into_planes();
        Ok(Planes::from_planes(extent, [values])?.map(|value| value * scale))
    }

    /// The path of a file of the sample `name`.
    pub(super) fn file(&self, name: &str, file: &str) -> PathBuf {
        self.root.join(name).join(file)
    }

    fn find(&self, name: &str, part: &'static str) -> Result<PathBuf, EvalError> {
        let folder = self.root.join(name);
        let found = match part {
            // As `relight decompose` calls it.
            "highlight" => self
                .existing(name, part)
                .or_else(|| self.existing(name, "specular")),
            _ => self.existing(name, part),
        };
        found.ok_or(EvalError::Unpredicted { folder, part })
    }

    fn existing(&self, name: &str, part: &str) -> Option<PathBuf> {
        let file = |extension| self.file(name, &format!("{part}.{extension}"));
        ["exr", "png"]
            .map(file)
            .into_iter()
            .find(|path| path.is_file())
    }
}

fn check_size(path: PathBuf, found: Extent, expected: Extent) -> Result<(), EvalError> {
    if found == expected {
        return Ok(());
    }
    Err(EvalError::Size {
        path,
        found,
        expected,
    })
}
