//! Folders of predictions.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::EvalError;
use relight_core::image::{Extent, Linear, Planes, Rgb, Transfer};
use relight_core::light::{LightError, Normals, NormalsFrame, ShLight};
use relit_data::text;

/// A folder with a folder of estimates for each image of the ground truth, of the same name:
/// `albedo`, `shading`, `highlight` (or `specular`), `normal` as `.exr` (linear, or vectors) or `.png` (8 or 16
/// bits), `light.txt` as lines of red, green and blue coefficients. Estimates that are a whole number of times larger than
/// the ground truth are brought to its size, each pixel the mean of those that it covers.
#[derive(Debug, Clone)]
pub struct Predictions {
    root: PathBuf,
    frame: NormalsFrame,
}

/// The file that `relight decompose` writes besides its layers.
const DESCRIPTION: &str = "decomposition.json";
/// Its schema.
const SCHEMA: &str = "relight.decomposition/1";

/// The fault of a description that does not parse.
pub(crate) const NO_SET: &str = "does not describe a set";

/// The part with its schema.
#[derive(Deserialize)]
struct Description {
    schema: String,
}

impl Predictions {
    /// The predictions in the folder `root`. PNGs hold colours in sRGB where `relight decompose` wrote an image's folder,
    /// and else linear.
    pub const fn new(root: PathBuf, frame: NormalsFrame) -> Self {
        Self { root, frame }
    }

    /// How a table names them: the folder's name.
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
        let image = Rgb::read(&path, self.transfer(name)?)?;
        Ok(Rgb::new(brought_to(path, image.into_planes(), extent)?))
    }

    /// The first PNG of colours of these samples that is read as linear light, because no file says how it is encoded.
    #[must_use]
    pub fn undescribed<'a>(&self, names: impl IntoIterator<Item = &'a str>) -> Option<PathBuf> {
        let mut names = names.into_iter();
        names.find_map(|name| {
            let parts = ["albedo", "shading", "highlight", "specular"];
            let mut files = parts.iter().filter_map(|part| self.existing(name, part));
            let png = files.find(|path| path.extension().is_some_and(|ending| ending == "png"));
            png.filter(|_| !self.file(name, DESCRIPTION).is_file())
        })
    }

    /// How PNGs of the sample `name` hold colours.
    fn transfer(&self, name: &str) -> Result<Transfer, EvalError> {
        let path = self.file(name, DESCRIPTION);
        let bytes = match std::fs::read(&path) {
            Ok(bytes) => bytes,
            Err(source) if source.kind() == ErrorKind::NotFound => return Ok(Transfer::Linear),
            Err(source) => return Err(EvalError::read(&path)(source)),
        };
        let parsed: Result<Description, _> = serde_json::from_slice(text::unmarked(&bytes));
        let description = parsed.map_err(EvalError::file(&path, NO_SET))?;
        if description.schema == SCHEMA {
            Ok(Transfer::Srgb)
        } else {
            Err(EvalError::schema(&path, &description.schema, SCHEMA))
        }
    }

    /// The predicted normals of the sample `name`.
    pub(super) fn normals(&self, name: &str, extent: Extent) -> Result<Normals, EvalError> {
        let path = self.find(name, "normal")?;
        let normals = match self.frame {
            NormalsFrame::YUp => Normals::read(&path)?,
            NormalsFrame::YDown => Normals::read(&path)?.flipped(),
        };
        Ok(Normals::new(brought_to(
            path,
            normals.into_planes(),
            extent,
        )?))
    }

    /// The predicted light of the sample `name`.
    pub(super) fn light(&self, name: &str) -> Result<ShLight, EvalError> {
        read_light(&self.file(name, "light.txt"))
    }

    /// The path of a file of the sample `name`.
    pub(super) fn file(&self, name: &str, file: &str) -> PathBuf {
        self.root.join(name).join(file)
    }

    fn find(&self, name: &str, part: &'static str) -> Result<PathBuf, EvalError> {
        let found = match part {
            // As `relight decompose` calls it.
            "highlight" => self
                .existing(name, part)
                .or_else(|| self.existing(name, "specular")),
            _ => self.existing(name, part),
        };
        found.ok_or_else(|| {
            EvalError::Unfit(format!(
                "{part}.exr or {part}.png is missing in {}: give a prediction for every image of the ground truth",
                self.root.join(name).display()
            ))
        })
    }

    fn existing(&self, name: &str, part: &str) -> Option<PathBuf> {
        let file = |extension| self.file(name, &format!("{part}.{extension}"));
        ["exr", "png"]
            .map(file)
            .into_iter()
            .find(|path| path.is_file())
    }
}

/// An estimate at the size of the ground truth: as it is, or averaged over blocks if it is larger by an integer factor.
fn brought_to(path: PathBuf, planes: Planes<3>, extent: Extent) -> Result<Planes<3>, EvalError> {
    let found = planes.extent();
    let times = found.width / extent.width.max(1);
    if times > 1 && found == Extent::new(times * extent.width, times * extent.height) {
        return Ok(planes.resized(extent));
    }
    if found == extent {
        return Ok(planes);
    }
    Err(EvalError::size(&path, found, extent))
}

/// A light in a file of coefficients.
pub(crate) fn read_light(path: &Path) -> Result<ShLight, EvalError> {
    let text = text::read(path).map_err(EvalError::read(path))?;
    let light: Result<ShLight, LightError> = text.parse();
    light.map_err(EvalError::file(path, "does not hold light"))
}
