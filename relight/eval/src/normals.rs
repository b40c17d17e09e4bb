//! Normals of single images: the table on the data of Janner et al.

use super::run::{Scored, add_method, cut_out, measured, need, object};
use super::{EvalError, EvalProgress, MaskRule, Predictions, ScoreTable};
use relight_core::image::Planes;
use relight_core::light::{Normals, YUp};
use relight_core::metrics::{
    AngularError, Comparison, SSIM_WINDOW, ScaleFit, angular_error, dssim,
};
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
    let mut table = ScoreTable::new("normals", notes);
    let steps = (1 + predictions.len()) * set.names().len();
    let progress = || progress(steps);
    let viewer = "all towards the viewer";
    add_method(&mut table, (set, split), viewer, &progress, |sample| {
        let to_viewer = Planes::filled(sample.extent(), [0.0, 0.0, 1.0]);
        score(sample, &Normals::new(to_viewer))
    })?;
    for found in predictions {
        add_method(
            &mut table,
            (set, split),
            &found.name(),
            &progress,
            |sample| score(sample, &found.normals(&sample.name, sample.extent())?),
        )?;
    }
    Ok(table)
}

fn score(sample: &TruthSample, found: &Normals<YUp>) -> Result<Vec<Scored>, EvalError> {
    let truth = need(sample, "normals", &sample.normals)?;
    let known = known(sample, truth);
    let whole = vec![true; known.len()];
    let angles = angular_error(
        sample.extent(),
        truth.planes().planes(),
        found.planes().planes(),
        &known,
    );
    let angles = measured(sample, angles)?;
    let (truth, found) = (truth.to_colours(), found.to_colours());
    let (truth, found) = (cut_out(&truth, &known), cut_out(&found, &known));
    let mut lines = Vec::new();
    for (mask, rule) in [(&known, MaskRule::Known), (&whole, MaskRule::WholeImage)] {
        let (truth, found) = (truth.planes(), found.planes());
        let pair = measured(
            sample,
            Comparison::new(sample.extent(), &truth, &found, mask),
        )?;
        let ssim = measured(sample, pair.ssim())?;
        let mut measures = vec![("MSE", pair.mse(ScaleFit::None)), ("DSSIM", dssim(ssim))];
        if rule == MaskRule::Known {
            measures.extend(named(&angles));
        }
        lines.push(Scored {
            part: "normals",
            measures,
            colour: "(n + 1) / 2",
            scale: ScaleFit::None.name(),
            mask: rule,
        });
    }
    Ok(lines)
}

/// The pixels of the object whose true normal is known.
pub(super) fn known(sample: &TruthSample, truth: &Normals<YUp>) -> Vec<bool> {
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
