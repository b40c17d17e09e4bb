//! Light of single images: the table on Light-Net.

use super::normals::known;
use super::run::{Scored, add_method, largest, measured, need};
use super::{EvalError, EvalProgress, MaskRule, Predictions, ScoreTable};
use relight_core::image::{Linear, Rgb};
use relight_core::light::{Direction, Order, ShLight};
use relight_core::metrics::{Comparison, ScaleFit, Ssim};
use relight_core::render::{DiffuseForm, DiffuseLayer, fit_light};
use relight_reader::{TruthSample, TruthSet};

/// Where light comes from.
#[derive(Debug, Clone)]
pub enum LightMethod {
    /// The same from everywhere.
    Even,
    /// Fitted to the true shading on the true normals: the best that light of order 2 can do.
    Oracle,
    /// It was predicted: `light.txt`.
    Predictions(Predictions),
}

impl LightMethod {
    fn name(&self) -> String {
        match self {
            Self::Even => "even light".to_owned(),
            Self::Oracle => "oracle: fitted to the ground truth".to_owned(),
            Self::Predictions(predictions) => predictions.name(),
        }
    }

    fn light(&self, sample: &TruthSample, known: &[bool]) -> Result<ShLight, EvalError> {
        match self {
            Self::Even => Ok(ShLight::even(Order::TWO, [1.0; 3])),
            Self::Oracle => fitted(sample, known),
            Self::Predictions(predictions) => predictions.light(&sample.name),
        }
    }
}

/// The light of order 2 that is nearest to the true shading on the true normals.
fn fitted(sample: &TruthSample, known: &[bool]) -> Result<ShLight, EvalError> {
    let normals = need(sample, "normals", &sample.normals)?;
    let shading = need(sample, "shading", &sample.shading)?;
    fit_light(normals, shading, known, 0.0).map_err(|source| EvalError::Unlit {
        sample: sample.name.clone(),
        source,
    })
}

/// MSE, SMSE and SSIM of the shading that light makes on the true normals, and the angle between its direction and that
/// of the true light, for each method. `form` says how shading follows from the coefficients.
///
/// # Errors
/// Where the ground truth or a prediction cannot be read or measured.
pub fn evaluate_light(
    set: &TruthSet,
    split: &str,
    form: DiffuseForm,
    methods: &[LightMethod],
    progress: EvalProgress<'_>,
) -> Result<ScoreTable, EvalError> {
    let mut table = ScoreTable {
        protocol: "light".to_owned(),
        notes: vec![
            "the shading that the light makes on the true normals, against the true shading"
                .to_owned(),
            format!(
                "MSE and SSIM after both were brought to a maximum of 1; SSIM by {}",
                Ssim::Gaussian.name()
            ),
            "direction: degrees between the bands 1 of the light and of the true light (where the set has none, of that \
             fitted to the true shading), 90 where one of them has no direction"
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
            |sample| {
                let normals = need(sample, "normals", &sample.normals)?;
                let known = known(sample, normals);
                let light = method.light(sample, &known)?;
                let found = DiffuseLayer::new(&light, form).shading(normals);
                let mut lines = score(sample, &found, &known)?;
                lines.push(direction_score(sample, &light, &known)?);
                Ok(lines)
            },
        )?;
    }
    Ok(table)
}

fn score(
    sample: &TruthSample,
    found: &Rgb<Linear>,
    known: &[bool],
) -> Result<Vec<Scored>, EvalError> {
    let truth = to_maximum_one(need(sample, "shading", &sample.shading)?, known);
    let found = to_maximum_one(found, known);
    let (truth, found) = (truth.planes().planes(), found.planes().planes());
    let pair = measured(
        sample,
        Comparison::new(sample.extent(), &truth, &found, known),
    )?;
    let ssim = measured(sample, pair.ssim(Ssim::Gaussian, 1.0))?;
    let line = |measures, scale: ScaleFit| Scored {
        part: "shading",
        measures,
        colour: "linear RGB, both maxima 1",
        scale: scale.name(),
        mask: MaskRule::Known,
    };
    Ok(vec![
        line(
            vec![("MSE", pair.mse(ScaleFit::None)), ("SSIM", ssim)],
            ScaleFit::None,
        ),
        line(vec![("SMSE", pair.mse(ScaleFit::Image))], ScaleFit::Image),
    ])
}

fn direction_score(
    sample: &TruthSample,
    found: &ShLight,
    known: &[bool],
) -> Result<Scored, EvalError> {
    let truth = match &sample.light {
        Some(light) => light.clone(),
        None => fitted(sample, known)?,
    };
    let cosine = match (direction(&truth), direction(found)) {
        (Some(truth), Some(found)) => truth.dot(found),
        _ => 0.0,
    };
    Ok(Scored {
        part: "direction",
        measures: vec![("degrees", cosine.clamp(-1.0, 1.0).acos().to_degrees())],
        colour: "mean of the channels",
        scale: ScaleFit::None.name(),
        mask: MaskRule::Known,
    })
}

/// Where most of the light comes from: its band 1, the mean of the channels. None of even light.
fn direction(light: &ShLight) -> Option<Direction> {
    let [y, z, x] = [1, 2, 3].map(|at: usize| light.coefficients()[at].iter().sum::<f64>());
    Direction::new(x, y, z)
}

/// The image with its largest value under the mask brought to 1; unchanged where all is dark.
fn to_maximum_one(image: &Rgb<Linear>, mask: &[bool]) -> Rgb<Linear> {
    let most = largest(image, mask);
    Rgb::new(image.planes().clone().map(|value| value / most))
}
