//! Shared by all protocols: a loop over the images of a set, and means over them.

use rayon::prelude::*;

use super::{EvalError, ImageScores, Measured, Predictions, ScoreLine, ScoreTable};
use relight_core::image::{Extent, Linear, Planes, Rgb};
use relight_core::metrics::{Comparison, MetricError, ScaleFit};
use relight_core::parallel;
use relight_core::reader::{TruthSample, TruthSet};

/// Called after each image, from many threads, with the number of all images.
pub type EvalProgress<'a> = &'a (dyn Fn(usize) + Sync);

/// The fault of a sample that cannot be measured.
pub(super) const NOT_MEASURED: &str = "cannot be measured";
/// The same if no light can be fitted.
pub(super) const UNLIT: &str = "cannot be lit: no light can be fitted to it";

/// What a baseline estimates of a sample.
pub(super) type Estimate<'a, E> = Box<dyn Fn(&TruthSample) -> Result<E, EvalError> + Sync + 'a>;

/// Measures the estimates of each baseline and of each prediction on each image of the set by `score`, which gives the same
/// lines for each, and adds the lines of means to the table.
pub(super) fn evaluate<'a, E>(
    mut table: ScoreTable,
    (set, split): (&TruthSet, &str),
    baselines: Vec<(&str, Estimate<'a, E>)>,
    predictions: &'a [Predictions],
    predicted: impl Fn(&Predictions, &TruthSample) -> Result<E, EvalError> + Sync + Copy + 'a,
    score: impl Fn(&TruthSample, &E) -> Result<Vec<ScoreLine>, EvalError> + Sync,
    progress: EvalProgress<'_>,
) -> Result<ScoreTable, EvalError> {
    let names: Vec<&str> = set.names().collect();
    let steps = (baselines.len() + predictions.len()) * names.len();
    let progress = || progress(steps);
    let baselines = baselines
        .into_iter()
        .map(|(name, of)| (name.to_owned(), of));
    let predictions = predictions.iter().map(|found| {
        let of: Estimate<'a, E> = Box::new(move |sample| predicted(found, sample));
        (found.name(), of)
    });
    let name = |index: usize| names[index].to_owned();
    for (method, estimate) in baselines.chain(predictions) {
        let scored = each(names.len(), &progress, name, |index| {
            let sample = set.load(index)?;
            score(&sample, &estimate(&sample)?)
        })?;
        add_lines(&mut table, &method, split, 1, scored);
    }
    Ok(table)
}

/// The results of `work` on `count` samples, in parallel, with their names. A panic is an error that names the sample.
pub(super) fn each<R: Send>(
    count: usize,
    progress: &(dyn Fn() + Sync),
    name: impl Fn(usize) -> String + Sync,
    work: impl Fn(usize) -> Result<R, EvalError> + Sync,
) -> Result<Vec<(String, R)>, EvalError> {
    (0..count)
        .into_par_iter()
        .map(|index| {
            let sample = name(index);
            match parallel::caught(|| work(index)) {
                Ok(found) => {
                    progress();
                    Ok((sample, found?))
                }
                Err(panic) => Err(EvalError::sample(&sample, NOT_MEASURED)(panic)),
            }
        })
        .collect()
}

/// Adds the lines of means, and the scores of each sample, which are of `images` images each.
pub(super) fn add_lines(
    table: &mut ScoreTable,
    method: &str,
    split: &str,
    images: usize,
    scored: Vec<(String, Vec<ScoreLine>)>,
) {
    table.lines.extend(lines(method, split, images, &scored));
    table
        .images
        .extend(scored.into_iter().map(|(image, scored)| ImageScores {
            method: method.to_owned(),
            image,
            measures: scored.iter().flat_map(named_by_part).collect(),
        }));
}

fn lines(
    method: &str,
    split: &str,
    each: usize,
    samples: &[(String, Vec<ScoreLine>)],
) -> Vec<ScoreLine> {
    let Some((_, first)) = samples.first() else {
        return Vec::new();
    };
    let mean = |line: usize, measure: usize| {
        let values = samples
            .iter()
            .map(|(_, scored)| scored[line].measures[measure].value);
        values.sum::<f64>() / samples.len() as f64
    };
    let line = |(at, scored): (usize, &ScoreLine)| {
        let mut line = scored.clone();
        for (measure, measured) in line.measures.iter_mut().enumerate() {
            measured.value = mean(at, measure);
        }
        method.clone_into(&mut line.method);
        split.clone_into(&mut line.split);
        line.images = samples.len() * each;
        line
    };
    first.iter().enumerate().map(line).collect()
}

fn named_by_part(scored: &ScoreLine) -> impl Iterator<Item = Measured> {
    scored.measures.iter().map(|one| Measured {
        name: format!(
            "{} {}, {}, {}",
            scored.part, one.name, scored.scale, scored.mask
        ),
        value: one.value,
    })
}

/// The squared error of an estimate, as it is and after the best scale, and its structural similarity.
pub(super) fn compared(
    sample: &str,
    truth: &Planes<3>,
    found: &Planes<3>,
    mask: &[bool],
) -> Result<[f64; 3], EvalError> {
    let compared = || {
        let pair = Comparison::new(truth.extent(), &truth.planes(), &found.planes(), mask)?;
        let ssim = pair.ssim()?;
        Ok([pair.mse(ScaleFit::None), pair.mse(ScaleFit::Image), ssim])
    };
    compared().map_err(|fault: MetricError| EvalError::sample(sample, NOT_MEASURED)(fault))
}

/// The part of a sample that the protocol needs.
pub(super) fn need<'a, T>(
    sample: &TruthSample,
    part: &'static str,
    found: &'a Option<T>,
) -> Result<&'a T, EvalError> {
    found.as_ref().ok_or_else(|| {
        let name = &sample.name;
        EvalError::Unfit(format!(
            "the ground truth has no {part} of {name}, which this protocol needs"
        ))
    })
}

/// Where the mask is 1.
pub(super) fn object(sample: &TruthSample) -> Vec<bool> {
    let mask = sample.mask.plane(0);
    mask.iter().map(|&value| value >= 0.5).collect()
}

/// The mean of the channels of each pixel.
pub(super) fn grey(image: &Rgb<Linear>) -> Vec<f32> {
    let [red, green, blue] = image.planes().planes();
    let channels = red.iter().zip(green).zip(blue);
    channels.map(|((r, g), b)| (r + g + b) / 3.0).collect()
}

/// An image with this plane in all channels.
pub(super) fn of_grey(extent: Extent, plane: Vec<f32>) -> Result<Rgb<Linear>, EvalError> {
    let planes = Planes::from_planes(extent, [plane.clone(), plane.clone(), plane])?;
    Ok(Rgb::new(planes))
}

/// The planes with 0 outside the mask.
pub(super) fn cut_out<const C: usize>(planes: &Planes<C>, mask: &[bool]) -> Planes<C> {
    let mut planes = planes.clone();
    for plane in planes.planes_mut() {
        for (value, &inside) in plane.iter_mut().zip(mask) {
            if !inside {
                *value = 0.0;
            }
        }
    }
    planes
}

/// The largest value under the mask, or 1 where all is dark.
pub(super) fn largest(image: &Rgb<Linear>, mask: &[bool]) -> f32 {
    let planes = image.planes().planes();
    let values = planes
        .iter()
        .flat_map(|plane| plane.iter().zip(mask))
        .filter(|(_, inside)| **inside);
    let most = values.fold(0.0_f32, |most, (&value, _)| most.max(value));
    if most > 0.0 { most } else { 1.0 }
}
