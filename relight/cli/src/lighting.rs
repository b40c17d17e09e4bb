//! Options that several verbs share: new light, videos in which it rotates, and shading models.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Args;
use relight_core::light::Panorama;
use relight_core::render::{DiffuseForm, SpecularForm};
use relight_photo::relighting::{DiscLamp, InsertError, LightSource, PanoramaView};

use crate::values::{Choices, degrees, one_of, within};

/// How many pixels of a picture there may be to one of the panorama that it shows.
const MAX_ENLARGEMENT: f64 = 4.0;

/// What to say of a panorama that is too coarse for the picture in which it is seen; none where it is not.
pub(crate) fn too_coarse(view: &PanoramaView, panorama: &Panorama) -> Option<String> {
    let enlargement = view.enlargement(panorama);
    let width = panorama.extent().width as f64;
    (enlargement > MAX_ENLARGEMENT).then(|| {
        let wanted = (width * enlargement / MAX_ENLARGEMENT / 1024.0).ceil() * 1024.0;
        format!(
            "the panorama has {:.1} pixels a degree and the picture {:.1}, so that it is blurred behind the object: give one of \
             {wanted} x {} pixels, or a smaller picture",
            width / 360.0,
            enlargement * width / 360.0,
            wanted / 2.0,
        )
    })
}

/// Whether the value of `--light` is the photograph's own light, and no file.
pub(crate) fn is_own(light: &Path) -> bool {
    light == Path::new("own")
}

/// New light.
#[derive(Args)]
pub(crate) struct LightArguments {
    /// The light: a panorama (.hdr, .exr; its centre is behind the object) or coefficients (.txt).
    #[arg(long, value_name = "FILE", conflicts_with = "lamp")]
    pub(crate) light: Option<PathBuf>,
    /// A lamp: degrees about the vertical (0 at the viewer, 90 on the right) and above the horizon, colour (#ffd9b0 or 3200K),
    /// size in degrees [default: white, 30].
    #[arg(
        long,
        value_name = "AZIMUTH,ELEVATION[,COLOUR][,SIZE]",
        allow_hyphen_values = true
    )]
    pub(crate) lamp: Option<Lamp>,
    /// Initial rotation of the light about the vertical, from the viewer to the right.
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, value_parser = degrees(), allow_hyphen_values = true)]
    pub(crate) light_angle: f64,
}

/// A lamp, as it was given and as it was read.
#[derive(Debug, Clone)]
pub(crate) struct Lamp {
    pub(crate) text: String,
    pub(crate) disc: DiscLamp,
}

impl FromStr for Lamp {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Ok(Self {
            text: text.to_owned(),
            disc: text.parse()?,
        })
    }
}

impl LightArguments {
    /// Whether no light is given.
    pub(crate) fn is_empty(&self) -> bool {
        self.light.is_none() && self.lamp.is_none()
    }

    /// The given light, before its rotation.
    pub(crate) fn read(&self) -> Result<Option<LightSource>, InsertError> {
        match (&self.lamp, &self.light) {
            (Some(lamp), _) => Ok(Some(LightSource::Lamp(lamp.disc))),
            (None, Some(path)) => LightSource::read(path).map(Some),
            (None, None) => Ok(None),
        }
    }

    /// Its angle, radians.
    pub(crate) fn angle(&self) -> f64 {
        self.light_angle.to_radians()
    }

    /// The file of coefficients and the file of a panorama; at most one is given.
    pub(crate) fn files(&self) -> (Option<&Path>, Option<&Path>) {
        match self.light.as_deref() {
            Some(path) if LightSource::is_text(path) => (Some(path), None),
            other => (None, other),
        }
    }
}

/// A video in which light rotates.
#[derive(Args)]
pub(crate) struct RotationArguments {
    /// Make a video in which the light rotates by so many degrees about the vertical.
    #[arg(long, value_name = "DEGREES", value_parser = degrees(), allow_hyphen_values = true)]
    pub(crate) rotate: Option<f64>,
    /// Length of the video, seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = within(0.01..=3600.0, "seconds"), requires = "rotate")]
    pub(crate) seconds: f64,
    /// Frames per second.
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=240), requires = "rotate")]
    pub(crate) fps: u32,
}

impl RotationArguments {
    /// How many frames the video has.
    pub(crate) fn frames(&self) -> u32 {
        let frames = (self.seconds * f64::from(self.fps)).round();
        frames.max(1.0) as u32
    }

    /// How far light has rotated at a frame, degrees.
    pub(crate) fn degrees_at(&self, frame: u32) -> f64 {
        let part = f64::from(frame) / f64::from(self.frames());
        self.rotate.unwrap_or(0.0) * part
    }
}

/// How light becomes shading and highlights.
#[derive(Args)]
pub(crate) struct ShadingArgument {
    /// How light becomes shading and highlights.
    #[arg(long, value_name = "MODEL", default_value = "physical", value_parser = one_of(SHADING_MODELS))]
    shading_model: (DiffuseForm, SpecularForm),
}

const SHADING_MODELS: Choices<(DiffuseForm, SpecularForm)> = &[
    (
        "physical",
        "Irradiance, and the Blinn-Phong lobe in zonal harmonics",
        (DiffuseForm::Irradiance, SpecularForm::Lobe),
    ),
    (
        "paper",
        "The paper's formulas as in its released code, from nine coefficients",
        (DiffuseForm::Released, SpecularForm::Power),
    ),
];

impl ShadingArgument {
    /// The diffuse layer.
    pub(crate) fn diffuse(&self) -> DiffuseForm {
        self.shading_model.0
    }

    /// The specular layer.
    pub(crate) fn specular(&self) -> SpecularForm {
        self.shading_model.1
    }
}
