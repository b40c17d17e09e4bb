//! Shared by all protocols: a loop over the images of a set, and means over them.

use rayon::prelude::*;

use super::{EvalError, ImageScores, MaskRule, Measured, ScoreLine, ScoreTable};
use relight_core::image::{Extent, Linear, Planes, Rgb};
use relight_core::metrics::MetricError;
use relight_core::parallel;
use relight_core::reader::{TruthSample, TruthSet};

/// Called after each image, from many threads, with the number of all images.
pub type EvalProgress<'a> = &'a (dyn Fn(usize) + Sync);

/// The fault of a sample that cannot be measured.
pub(super) const NOT_MEASURED: &str = "cannot be measured";
/// The same if no light can be fitted.
pub(super) const UNLIT: &str = "cannot be lit: no light can be fitted to it";

/// A measure of one image that becomes part of a line.
pub(super) struct Scored {
    /// What was compared.
    pub(super) part: &'static str,
    /// The measures, in the table's order.
    pub(super) measures: Vec<(&'static str, f64)>,
    pub(super) colour: &'static str,
    pub(super) scale: &'static str,
    pub(super) mask: MaskRule,
}

/// Measures each image of the set with `score`, which gives the same lines for each, and adds the
/// lines of means to the table.
pub(super) fn add_method(
    table: &mut ScoreTable,
    (set, split): (&TruthSet, &str),
    method: &str,
    progress: &(dyn Fn() + Sync),
    score: impl Fn(&TruthSample) -> Result<Vec<Scored>, EvalError> + Sync,
) -> Result<(), EvalError> {
    let names: Vec<&str> = set.names().collect();
    let name = |index: usize| names[index].to_owned();
    let scored = each(names.len(), progress, name, |index| {
        score(&set.load(index)?)
    })?;
    add_lines(table, method, split, 1, scored);
    Ok(())
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
    scored: Vec<(String, Vec<Scored>)>,
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
    samples: &[(String, Vec<Scored>)],
) -> Vec<ScoreLine> {
    let Some((_, first)) = samples.first() else {
        return Vec::new();
    };
    let mean = |line: usize, measure: usize| {
        let values = samples
            .iter()
            .map(|(_, scored)| scored[line].measures[measure].1);
        values.sum::<f64>() / samples.len() as f64
    };
    let line = |(at, scored): (usize, &Scored)| ScoreLine {
        method: method.to_owned(),
        part: scored.part.to_owned(),
        measures: (0..scored.measures.len())
            .map(|measure| Measured {
                name: scored.measures[measure].0.to_owned(),
                value: mean(at, measure),
            })
            .collect(),
        colour: scored.colour.to_owned(),
        scale: scored.scale.to_owned(),
        mask: scored.mask,
        images: samples.len() * each,
        split: split.to_owned(),
    };
    first.iter().enumerate().map(line).collect()
}

fn named_by_part(scored: &Scored) -> impl Iterator<Item = Measured> {
    scored.measures.iter().map(|(name, value)| Measured {
        name: format!("{} {name}, {}, {}", scored.part, scored.scale, scored.mask),
        value: *value,
    })
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

/// The measurement of a sample, with the sample's name in an error.
pub(super) fn measured<T>(
    sample: &TruthSample,
    result: Result<T, MetricError>,
) -> Result<T, EvalError> {
    result.map_err(EvalError::sample(&sample.name, NOT_MEASURED))
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
