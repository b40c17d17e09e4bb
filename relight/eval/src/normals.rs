//! Normals of single images: the table on the data of Janner et al.

use super::run::{Scored, add_method, cut_out, measured, need, object};
use super::{EvalError, EvalProgress, MaskRule, Predictions, ScoreTable};
use relight_core::image::Planes;
use relight_core::light::{Normals, YUp};
use relight_core::metrics::{AngularError, Comparison, ScaleFit, Ssim, angular_error, dssim};
use relight_reader::{TruthSample, TruthSet};

/// Where normals come from.
#[derive(Debug, Clone)]
pub enum NormalMethod {
    /// All of them point to the viewer.
    Viewer,
    /// They were predicted: part `normal`.
    Predictions(Predictions),
}

impl NormalMethod {
    fn name(&self) -> String {
        match self {
            Self::Viewer => "all towards the viewer".to_owned(),
            Self::Predictions(predictions) => predictions.name(),
        }
    }

    fn normals(&self, sample: &TruthSample) -> Result<Normals<YUp>, EvalError> {
        let extent = sample.extent();
        match self {
            Self::Viewer => Ok(Normals::new(Planes::filled(extent, [0.0, 0.0, 1.0]))),
            Self::Predictions(predictions) => predictions.normals(&sample.name, extent),
        }
    }
}

/// MSE and DSSIM of normal maps, and the angles between normals, for each method.
///
/// # Errors
/// Where the ground truth or a prediction cannot be read or measured.
pub fn evaluate_normals(
    set: &TruthSet,
    split: &str,
    methods: &[NormalMethod],
    progress: EvalProgress<'_>,
) -> Result<ScoreTable, EvalError> {
    let mut table = ScoreTable {
        protocol: "normals".to_owned(),
        notes: vec![
            format!(
                "MSE and DSSIM: of the colours (n + 1) / 2, SSIM by {}",
                Ssim::Gaussian.name()
            ),
            "angles: degrees; within: the fraction of pixels with an angle of at most so much"
                .to_owned(),
        ],
        lines: Vec::new(),
        images: Vec::new(),
    };
    for method in methods {
        add_method(
            &mut table,
            (set, split),
            &method.name(),
            progress,
            |sample| score(sample, &method.normals(sample)?),
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
        let ssim = measured(sample, pair.ssim(Ssim::Gaussian, 1.0))?;
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
