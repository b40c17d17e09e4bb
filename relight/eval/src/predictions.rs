//! Folders of predictions.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::EvalError;
use relight_core::files::read_planes;
use relight_core::image::{Extent, Linear, Planes, Rgb, Samples, Transfer};
use relight_core::light::NormalsFrame;
use relight_core::light::{Normals, ShLight, YDown, YUp};
use relight_core::render::{Gloss, Surface};
use relit_data::text;

/// A folder with a folder for each image of the ground truth, of the same name, in which the estimates lie:
/// `albedo`, `shading`, `highlight` (or `specular`), `normal` as `.exr` (linear, or vectors) or `.png` (8 or 16
/// bits), `light.txt` as lines of red, green and blue coefficients. Estimates that are a whole number of times larger than
/// the ground truth are brought to its size, each pixel the mean of those that it covers.
#[derive(Debug, Clone)]
pub struct Predictions {
    root: PathBuf,
    /// As the caller says; none: as the folder says.
    transfer: Option<Transfer>,
    frame: NormalsFrame,
}

/// What `relight decompose` writes beside its layers.
const DESCRIPTION: &str = "decomposition.json";
/// What that says it is.
const SCHEMA: &str = "relight.decomposition/1";

/// The part of it that says how its PNGs hold colours. The first files of the schema did not say it, and held sRGB.
#[derive(Deserialize)]
struct Encoding {
    schema: String,
    transfer: Option<String>,
}

impl Predictions {
    /// The predictions in the folder `root`, of which PNGs hold colours by `transfer`. Where that is none, an image's
    /// folder says it if `relight decompose` wrote it, and else they are linear.
    #[must_use]
    pub const fn new(root: PathBuf, transfer: Option<Transfer>, frame: NormalsFrame) -> Self {
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
        let image = Rgb::read(&path, self.transfer(name)?)?;
        Ok(Rgb::new(brought_to(path, image.into_planes(), extent)?))
    }

    /// How PNGs of the sample `name` hold colours.
    fn transfer(&self, name: &str) -> Result<Transfer, EvalError> {
        let written = self.written_transfer(name)?;
        match (self.transfer, written) {
            (Some(said), Some(written)) if said != written => Err(EvalError::Encoding {
                path: self.file(name, DESCRIPTION),
                written: transfer_name(written),
                said: transfer_name(said),
            }),
            (said, written) => Ok(said.or(written).unwrap_or(Transfer::Linear)),
        }
    }

    /// How they do by the description beside them; none where there is none, or it describes something else.
    fn written_transfer(&self, name: &str) -> Result<Option<Transfer>, EvalError> {
        let path = self.file(name, DESCRIPTION);
        let bytes = match std::fs::read(&path) {
            Ok(bytes) => bytes,
            Err(source) if source.kind() == ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(EvalError::Read { path, source }),
        };
        let parsed: Result<Encoding, _> = serde_json::from_slice(text::unmarked(&bytes));
        let encoding = match parsed {
            Ok(encoding) => encoding,
            Err(source) => return Err(EvalError::Description { path, source }),
        };
        if encoding.schema != SCHEMA {
            return Err(EvalError::Schema {
                path,
                found: encoding.schema,
                expected: SCHEMA,
            });
        }
        match encoding.transfer.as_deref() {
            None | Some("srgb") => Ok(Some(Transfer::Srgb)),
            Some("linear") => Ok(Some(Transfer::Linear)),
            Some(other) => Err(EvalError::Schema {
                path,
                found: format!("transfer {other}"),
                expected: "transfer srgb or linear",
            }),
        }
    }

    /// The predicted normals of the sample `name`.
    pub(super) fn normals(&self, name: &str, extent: Extent) -> Result<Normals<YUp>, EvalError> {
        let path = self.find(name, "normal")?;
        let normals = match self.frame {
            NormalsFrame::YUp => Normals::<YUp>::read(&path)?,
            NormalsFrame::YDown => Normals::<YDown>::read(&path)?.flipped(),
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

/// An estimate at the size of the ground truth: as it is, or the means over blocks where it is so many times larger.
fn brought_to(path: PathBuf, planes: Planes<3>, extent: Extent) -> Result<Planes<3>, EvalError> {
    let found = planes.extent();
    let times = found.width / extent.width.max(1);
    if times > 1 && found == Extent::new(times * extent.width, times * extent.height) {
        return Ok(planes.resized(extent));
    }
    check_size(path, found, extent)?;
    Ok(planes)
}

fn transfer_name(transfer: Transfer) -> &'static str {
    match transfer {
        Transfer::Linear => "linear",
        Transfer::Srgb => "sRGB",
        Transfer::Gamma22 => "of gamma 2.2",
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

/// A light in a file of coefficients.
pub(crate) fn read_light(path: &Path) -> Result<ShLight, EvalError> {
    let text = text::read(path).map_err(|source| EvalError::Read {
        path: path.to_owned(),
        source,
    })?;
    text.parse().map_err(|source| EvalError::Light {
        path: path.to_owned(),
        source,
    })
}
