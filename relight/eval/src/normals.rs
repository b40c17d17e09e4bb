//! Normals of single images: the table on the data of Janner et al.

use super::run::{NOT_MEASURED, compared, cut_out, evaluate, need, object};
use super::{EvalError, EvalProgress, MaskRule, Predictions, ScoreLine, ScoreTable};
use relight_core::image::Planes;
use relight_core::light::Normals;
use relight_core::metrics::{AngularError, SSIM_WINDOW, ScaleFit, angular_error, dssim};
use relight_core::reader::{TruthSample, TruthSet};

/// MSE and DSSIM of normal maps, and the angles between normals, for normals that all point to the viewer and for each
/// prediction (part `normal`).
///
/// # Errors
/// If the ground truth or a prediction cannot be read or measured.
pub fn evaluate_normals(
    set: &TruthSet,
    split: &str,
    predictions: &[Predictions],
    progress: EvalProgress<'_>,
) -> Result<ScoreTable, EvalError> {
    let notes = vec![
        format!(
            "MSE and DSSIM: of the colours (n + 1) / 2, SSIM by {}",
            SSIM_WINDOW
        ),
        "angles: degrees; within: the fraction of pixels with an angle of at most so much"
            .to_owned(),
    ];
    let to_viewer = |sample: &TruthSample| {
        let planes = Planes::filled(sample.extent(), [0.0, 0.0, 1.0]);
        Ok(Normals::new(planes))
    };
    evaluate(
        ScoreTable::new("normals", notes),
        (set, split),
        vec![("all towards the viewer", Box::new(to_viewer))],
        predictions,
        |found, sample| found.normals(&sample.name, sample.extent()),
        score,
        progress,
    )
}

fn score(sample: &TruthSample, found: &Normals) -> Result<Vec<ScoreLine>, EvalError> {
    let truth = need(sample, "normals", &sample.normals)?;
    let known = known(sample, truth);
    let whole = vec![true; known.len()];
    let angles = angular_error(
        sample.extent(),
        truth.planes().planes(),
        found.planes().planes(),
        &known,
    );
    let angles = angles.map_err(EvalError::sample(&sample.name, NOT_MEASURED))?;
    let (truth, found) = (truth.to_colours(), found.to_colours());
    let (truth, found) = (cut_out(&truth, &known), cut_out(&found, &known));
    let mut lines = Vec::new();
    for (mask, rule) in [(&known, MaskRule::Known), (&whole, MaskRule::WholeImage)] {
        let [mse, _, ssim] = compared(&sample.name, &truth, &found, mask)?;
        let mut measures = vec![("MSE", mse), ("DSSIM", dssim(ssim))];
        if rule == MaskRule::Known {
            measures.extend(named(&angles));
        }
        let values = ("(n + 1) / 2", ScaleFit::None);
        lines.push(ScoreLine::of_image("normals", &measures, values, rule));
    }
    Ok(lines)
}

/// The pixels of the object whose true normal is known.
pub(super) fn known(sample: &TruthSample, truth: &Normals) -> Vec<bool> {
    let [x, y, z] = truth.planes().planes();
    let mask = object(sample).into_iter().enumerate();
    mask.map(|(at, inside)| inside && (x[at], y[at], z[at]) != (0.0, 0.0, 0.0))
        .collect()
}

fn named(angles: &AngularError) -> [(&'static str, f64); 5] {
    let [a, b, c] = angles.within;
    [
        ("mean angle", angles.mean),
        ("median angle", angles.median),
        ("within 11.25", a),
        ("within 22.5", b),
        ("within 30", c),
    ]
}
