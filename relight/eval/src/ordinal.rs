//! Albedo of photographs, judged by people: WHDR on Intrinsic Images in the Wild.

use super::run::{Scored, add_lines, each};
use super::{EvalError, EvalProgress, MaskRule, Predictions, ScoreTable};
use relight_core::image::{Linear, Planes, Rgb, Transfer};
use relight_core::metrics::{ScaleFit, whdr};
use relight_reader::JudgedImages;

/// By how much a surface must be brighter for the other to be called darker.
const DELTA: f64 = 0.1;

/// Finds the albedo of a numbered image.
type Finder<'a> = &'a (dyn Fn(usize, Rgb<Linear>) -> Result<Rgb<Linear>, EvalError> + Sync);

/// WHDR at delta 0.1, for an albedo that is the same everywhere, for one that is the image, and for the predictions
/// (`albedo`): the mean over images.
///
/// # Errors
/// Where an image, its judgements or a prediction cannot be read or measured.
pub fn evaluate_ordinal(
    images: &JudgedImages,
    split: &str,
    predictions: &[Predictions],
    progress: EvalProgress<'_>,
) -> Result<ScoreTable, EvalError> {
    let mut table = ScoreTable::new(
        "ordinal albedo",
        vec![format!(
            "WHDR: weighted human disagreement rate, delta {DELTA}"
        )],
    );
    let mut add = |method: &str, find: Finder<'_>| {
        let name = |index| images.name(index);
        let scored = each(images.len(), progress, name, |index| {
            let image = Rgb::<Linear>::read(&images.image(index), Transfer::Srgb)?;
            Ok(vec![score(images, index, &find(index, image)?)?])
        })?;
        add_lines(&mut table, method, split, 1, scored);
        Ok::<(), EvalError>(())
    };
    add("constant albedo", &|_, image| {
        Ok(Rgb::new(Planes::filled(image.planes().extent(), [0.5; 3])))
    })?;
    add("constant shading", &|_, image| Ok(image))?;
    for one in predictions {
        add(&one.name(), &|index, image| {
            one.colour(&images.name(index), "albedo", image.planes().extent())
        })?;
    }
    Ok(table)
}

fn score(images: &JudgedImages, index: usize, albedo: &Rgb<Linear>) -> Result<Scored, EvalError> {
    let judgements = images.judgements(index)?;
    let planes = albedo.planes();
    let rate = whdr(planes.extent(), &planes.planes(), &judgements, DELTA);
    let rate = rate.map_err(EvalError::unmeasured(&images.name(index)))?;
    Ok(Scored {
        part: "albedo",
        measures: vec![("WHDR", rate)],
        colour: "linear grey",
        scale: ScaleFit::None.name(),
        mask: MaskRule::Points,
    })
}
