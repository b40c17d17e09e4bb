//! Albedo of photographs, judged by people: WHDR on Intrinsic Images in the Wild.

use super::run::{Scored, add_lines, each};
use super::{EvalError, EvalProgress, MaskRule, Predictions, ScoreTable};
use relight_core::image::{Linear, Planes, Rgb, Transfer};
use relight_core::metrics::{ScaleFit, whdr};
use relight_reader::JudgedImages;

/// By how much a surface must be brighter for the other to be called darker.
const DELTA: f64 = 0.1;

/// Where albedo comes from.
#[derive(Debug, Clone)]
pub enum OrdinalMethod {
    /// It is the same everywhere.
    ConstantAlbedo,
    /// It is the image.
    ConstantShading,
    /// It was predicted: part `albedo`.
    Predictions(Predictions),
}

impl OrdinalMethod {
    fn name(&self) -> String {
        match self {
            Self::ConstantAlbedo => "constant albedo".to_owned(),
            Self::ConstantShading => "constant shading".to_owned(),
            Self::Predictions(predictions) => predictions.name(),
        }
    }

    fn albedo(&self, images: &JudgedImages, index: usize) -> Result<Rgb<Linear>, EvalError> {
        let image = Rgb::<Linear>::read(&images.image(index), Transfer::Srgb)?;
        let extent = image.planes().extent();
        match self {
            Self::ConstantAlbedo => Ok(Rgb::new(Planes::filled(extent, [0.5; 3]))),
            Self::ConstantShading => Ok(image),
            Self::Predictions(predictions) => {
                predictions.colour(&images.name(index), "albedo", extent)
            }
        }
    }
}

/// WHDR at delta 0.1, for each method: the mean over images.
///
/// # Errors
/// Where an image, its judgements or a prediction cannot be read or measured.
pub fn evaluate_ordinal(
    images: &JudgedImages,
    split: &str,
    methods: &[OrdinalMethod],
    progress: EvalProgress<'_>,
) -> Result<ScoreTable, EvalError> {
    let mut table = ScoreTable {
        protocol: "ordinal albedo".to_owned(),
        notes: vec![format!(
            "WHDR: weighted human disagreement rate, delta {DELTA}"
        )],
        lines: Vec::new(),
        images: Vec::new(),
    };
    for method in methods {
        let name = |index| images.name(index);
        let scored = each(images.len(), progress, name, |index| {
            Ok(vec![score(images, index, method)?])
        })?;
        add_lines(&mut table, &method.name(), split, 1, scored);
    }
    Ok(table)
}

fn score(images: &JudgedImages, index: usize, method: &OrdinalMethod) -> Result<Scored, EvalError> {
    let albedo = method.albedo(images, index)?;
    let judgements = images.judgements(index)?;
    let planes = albedo.planes();
    let rate = whdr(planes.extent(), &planes.planes(), &judgements, DELTA);
    let rate = rate.map_err(|source| EvalError::Metric {
        sample: images.name(index),
        source,
    })?;
    Ok(Scored {
        part: "albedo",
        measures: vec![("WHDR", rate)],
        colour: "linear grey",
        scale: ScaleFit::None.name(),
        mask: MaskRule::Points,
    })
}
