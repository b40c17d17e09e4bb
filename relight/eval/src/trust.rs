//! Whether what is said to be doubtful is wrong: trust maps beside the true error.

use rayon::prelude::*;
use serde::Serialize;

use super::run::need;
use super::{EvalError, EvalProgress};
use relight_core::image::Planes;
use relight_photo::decompose::{DecomposeOptions, Decomposer};
use relight_photo::insert::TrustMap;
use relight_reader::{TruthSample, TruthSet};

/// The parts of the pixels that are kept, for the curves.
const KEPT: [f64; 10] = [1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1];

/// How the true error falls where less and less trusted pixels are left out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrustCurve {
    /// What the pixels are ordered by.
    pub order: String,
    /// For each part of the pixels that is kept, the most trusted ones, the mean angle between found and true normals, degrees.
    pub degrees: Vec<f64>,
    /// Spearman's rank correlation of doubt and error within an object, the mean over all objects.
    pub rank_within: f64,
    /// That of the objects' mean doubts and mean errors.
    pub rank_between: f64,
}

/// Trust beside truth.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct TrustTable {
    /// How many images there were.
    pub images: usize,
    /// Which part of which data they are.
    pub split: String,
    /// The parts of the pixels that are kept.
    pub kept: Vec<f64>,
    /// The curves: by all doubts, by each of them, by chance, and by the error itself.
    pub curves: Vec<TrustCurve>,
}

/// The errors and doubts of an image's pixels.
struct Judged {
    error: Vec<f64>,
    /// By order of [`ORDERS`].
    doubts: [Vec<f64>; ORDERS.len()],
}

const ORDERS: [&str; 6] = [
    "all doubts",
    "not explained by the light",
    "mirrored",
    "rescaled",
    "chance",
    "the error itself",
];

/// Takes every image of a set apart, and orders its pixels by trust.
///
/// # Errors
/// Where the ground truth cannot be read or lacks images or normals, or the network fails.
pub fn evaluate_trust(
    set: &TruthSet,
    split: &str,
    decomposer: &Decomposer,
    progress: EvalProgress<'_>,
) -> Result<TrustTable, EvalError> {
    let judged = (0..set.names().len())
        .into_par_iter()
        .map(|index| {
            let sample = set.load(index)?;
            let judged = judge(&sample, decomposer)?;
            progress();
            Ok(judged)
        })
        .collect::<Result<Vec<_>, EvalError>>()?;
    Ok(TrustTable {
        images: judged.len(),
        split: split.to_owned(),
        kept: KEPT.to_vec(),
        curves: (0..ORDERS.len())
            .map(|order| curve(&judged, order))
            .collect(),
    })
}

fn judge(sample: &TruthSample, decomposer: &Decomposer) -> Result<Judged, EvalError> {
    let picture = match &sample.diffuse {
        Some(diffuse) => diffuse,
        None => need(sample, "image", &sample.image)?,
    };
    let truth = need(sample, "normals", &sample.normals)?;
    let failed = |source: relight_photo::insert::InsertError| EvalError::Insertion {
        sample: sample.name.clone(),
        source: Box::new(source),
    };
    let options = DecomposeOptions::default();
    let found = decomposer
        .decompose(picture, &sample.mask, &options)
        .map_err(|error| failed(error.into()))?;
    let trust =
        TrustMap::of_picture(picture, &sample.mask, decomposer, &options).map_err(failed)?;
    let doubt = trust.doubt();
    let (a, b) = (found.normals.planes().planes(), truth.planes().planes());
    let mut judged = Judged {
        error: Vec::new(),
        doubts: Default::default(),
    };
    for at in 0..sample.mask.extent().pixels() {
        let is_known = (0..3).any(|c| b[c][at] != 0.0);
        if sample.mask.plane(0)[at] < 0.5 || !is_known {
            continue;
        }
        let dot: f64 = (0..3)
            .map(|c| f64::from(a[c][at]) * f64::from(b[c][at]))
            .sum();
        let error = dot.clamp(-1.0, 1.0).acos().to_degrees();
        let chance = (at as f64 * 0.618_033_988_75).fract();
        let of = |map: &Planes<1>| f64::from(map.plane(0)[at]);
        let all = [
            of(&doubt),
            of(&trust.unexplained),
            of(&trust.mirrored),
            of(&trust.rescaled),
            chance,
            error,
        ];
        judged.error.push(error);
        for (list, value) in judged.doubts.iter_mut().zip(all) {
            list.push(value);
        }
    }
    Ok(judged)
}

fn curve(judged: &[Judged], order: usize) -> TrustCurve {
    let judged: Vec<&Judged> = judged.iter().filter(|one| one.error.len() > 1).collect();
    let degrees = KEPT.map(|part| {
        let means = judged.iter().map(|one| kept_error(one, order, part));
        means.sum::<f64>() / judged.len().max(1) as f64
    });
    let within = judged
        .iter()
        .map(|one| rank_correlation(&one.doubts[order], &one.error));
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let between: (Vec<f64>, Vec<f64>) = judged
        .iter()
        .map(|one| (mean(&one.doubts[order]), mean(&one.error)))
        .unzip();
    TrustCurve {
        order: ORDERS[order].to_owned(),
        degrees: degrees.to_vec(),
        rank_within: within.sum::<f64>() / judged.len().max(1) as f64,
        rank_between: rank_correlation(&between.0, &between.1),
    }
}

/// The mean error of the part of an image's pixels that is trusted most.
fn kept_error(judged: &Judged, order: usize, part: f64) -> f64 {
    let mut pixels: Vec<usize> = (0..judged.error.len()).collect();
    pixels.sort_by(|&a, &b| judged.doubts[order][a].total_cmp(&judged.doubts[order][b]));
    let count = ((pixels.len() as f64 * part).round() as usize).max(1);
    pixels[..count]
        .iter()
        .map(|&at| judged.error[at])
        .sum::<f64>()
        / count as f64
}

/// Spearman's rank correlation; 0 where one of the lists does not vary.
fn rank_correlation(a: &[f64], b: &[f64]) -> f64 {
    let (a, b) = (ranks(a), ranks(b));
    let middle = (a.len() as f64 - 1.0) / 2.0;
    let product = |a: &[f64], b: &[f64]| {
        a.iter()
            .zip(b)
            .map(|(a, b)| (a - middle) * (b - middle))
            .sum::<f64>()
    };
    let all = (product(&a, &a) * product(&b, &b)).sqrt();
    if all > 0.0 {
        product(&a, &b) / all
    } else {
        0.0
    }
}

/// The place of each value in the order of all; equal values share the mean of theirs.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    let mut start = 0;
    while start < order.len() {
        let same = order[start..]
            .iter()
            .take_while(|&&at| values[at] == values[order[start]])
            .count();
        let mean = start as f64 + (same as f64 - 1.0) / 2.0;
        for &at in &order[start..start + same] {
            ranks[at] = mean;
        }
        start += same;
    }
    ranks
}

impl std::fmt::Display for TrustTable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "trust, {} images, {}", self.images, self.split)?;
        writeln!(
            f,
            "  mean angle between found and true normals, degrees, of the most trusted part of each object's pixels"
        )?;
        write!(f, "{:28}", "ordered by")?;
        for part in &self.kept {
            write!(f, "{:>7}", format!("{:.0} %", 100.0 * part))?;
        }
        writeln!(f, "  rank within  between")?;
        for curve in &self.curves {
            write!(f, "{:28}", curve.order)?;
            for degrees in &curve.degrees {
                write!(f, "{degrees:7.2}")?;
            }
            writeln!(
                f,
                "  {:11.3}  {:7.3}",
                curve.rank_within, curve.rank_between
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_correlate_whatever_the_values() {
        let values = [0.1, 5.0, 2.0, 100.0];
        let squares = values.map(|v: f64| v * v);
        assert!((rank_correlation(&values, &squares) - 1.0).abs() < 1e-12);
        assert!((rank_correlation(&values, &values.map(|v: f64| -v)) + 1.0).abs() < 1e-12);
        assert_eq!(rank_correlation(&values, &[1.0; 4]), 0.0);
        assert_eq!(ranks(&[3.0, 1.0, 3.0]), [1.5, 0.0, 1.5]);
    }

    #[test]
    fn a_curve_falls_where_doubt_tells_the_error_and_stays_by_chance() {
        let error: Vec<f64> = (0..100).map(f64::from).collect();
        let chance = (0..100)
            .map(|at| (f64::from(at) * 0.618_033_988_75).fract())
            .collect();
        let doubts = [
            error.clone(),
            error.clone(),
            error.clone(),
            error.clone(),
            chance,
            error.clone(),
        ];
        let judged = [Judged { error, doubts }];
        let told = curve(&judged, 0);
        assert!((told.degrees[0] - 49.5).abs() < 1e-9 && (told.degrees[9] - 4.5).abs() < 1e-9);
        let chance = curve(&judged, 4);
        assert!((chance.degrees[9] - 49.5).abs() < 15.0 && chance.rank_within.abs() < 0.2);
    }
}
