//! Albedo of photographs, judged by people: WHDR on Intrinsic Images in the Wild.

use super::run::{NOT_MEASURED, Scored, add_lines, each};
use super::{EvalError, EvalProgress, MaskRule, Predictions, ScoreTable};
use relight_core::image::{Linear, Planes, Rgb, Transfer};
use relight_core::metrics::{ScaleFit, whdr};
use relight_core::reader::JudgedImages;

/// By how much a surface must be brighter for the other to be called darker.
const DELTA: f64 = 0.1;

/// WHDR at delta 0.1, the mean over images: for the same albedo everywhere, for the image as its albedo, and for each
/// prediction (part `albedo`).
///
/// # Errors
/// Where an image, its judgements or a prediction cannot be read or measured.
pub fn evaluate_ordinal(
    images: &JudgedImages,
    split: &str,
    predictions: &[Predictions],
    progress: EvalProgress<'_>,
) -> Result<ScoreTable, EvalError> {
    let note = format!("WHDR: weighted human disagreement rate, delta {DELTA}");
    let mut table = ScoreTable::new("ordinal albedo", vec![note]);
    let steps = (2 + predictions.len()) * images.len();
    let progress = || progress(steps);
    let mut add = |name: &str, albedo: &AlbedoOf<'_>| -> Result<(), EvalError> {
        let scored = each(
            images.len(),
            &progress,
            |index| images.name(index),
            |index| {
                let image = Rgb::<Linear>::read(&images.image(index), Transfer::Srgb)?;
                Ok(vec![score(images, index, &albedo(index, image)?)?])
            },
        )?;
        add_lines(&mut table, name, split, 1, scored);
        Ok(())
    };
    add("constant albedo", &|_, image| {
        Ok(Rgb::new(Planes::filled(image.planes().extent(), [0.5; 3])))
    })?;
    add("constant shading", &|_, image| Ok(image))?;
    for found in predictions {
        add(&found.name(), &|index, image| {
            found.colour(&images.name(index), "albedo", image.planes().extent())
        })?;
    }
    Ok(table)
}

/// The albedo of an image, by its number and what it shows.
type AlbedoOf<'a> = dyn Fn(usize, Rgb<Linear>) -> Result<Rgb<Linear>, EvalError> + Sync + 'a;

fn score(images: &JudgedImages, index: usize, albedo: &Rgb<Linear>) -> Result<Scored, EvalError> {
    let judgements = images.judgements(index)?;
    let planes = albedo.planes();
    let rate = whdr(planes.extent(), &planes.planes(), &judgements, DELTA);
    let rate = rate.map_err(EvalError::sample(&images.name(index), NOT_MEASURED))?;
    Ok(Scored {
        part: "albedo",
        measures: vec![("WHDR", rate)],
        colour: "linear grey",
        scale: ScaleFit::None.name(),
        mask: MaskRule::Points,
    })
}
