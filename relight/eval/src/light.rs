//! Light of single images: the table on Light-Net.

use super::normals::known;
use super::run::{Estimate, UNLIT, compared, evaluate, largest, need};
use super::{EvalError, EvalProgress, MaskRule, Predictions, ScoreLine, ScoreTable};
use relight_core::image::{Linear, Rgb};
use relight_core::light::{Direction, Order, ShLight};
use relight_core::metrics::{SSIM_WINDOW, ScaleFit};
use relight_core::reader::{TruthSample, TruthSet};
use relight_core::render::{DiffuseForm, DiffuseLayer, fit_light};

/// The light of order 2 that is nearest to the true shading on the true normals.
fn fitted(sample: &TruthSample) -> Result<ShLight, EvalError> {
    let normals = need(sample, "normals", &sample.normals)?;
    let shading = need(sample, "shading", &sample.shading)?;
    let light = fit_light(normals, shading, &known(sample, normals), 0.0);
    light.map_err(EvalError::sample(&sample.name, UNLIT))
}

/// MSE, SMSE and SSIM of the shading that light makes on the true normals, and the angle between its direction and that
/// of the true light: for even light, for that which is fitted to the true shading, the best that light of order 2 can do, and
/// for each prediction (`light.txt`). `form` gives the shading from the coefficients.
///
/// # Errors
/// If the ground truth or a prediction cannot be read or measured.
pub fn evaluate_light(
    set: &TruthSet,
    split: &str,
    form: DiffuseForm,
    predictions: &[Predictions],
    progress: EvalProgress<'_>,
) -> Result<ScoreTable, EvalError> {
    let notes = vec![
        "the shading that the light makes on the true normals, against the true shading".to_owned(),
        format!(
            "MSE and SSIM after both were brought to a maximum of 1; SSIM by {}",
            SSIM_WINDOW
        ),
        "direction: degrees between band 1 of the light and of the true light (or that fitted to the true shading), 90 \
         if one has no direction"
            .to_owned(),
    ];
    let even = |_: &TruthSample| Ok(ShLight::even(Order::TWO, [1.0; 3]));
    let baselines: Vec<(&str, Estimate<'_, ShLight>)> = vec![
        ("even light", Box::new(even)),
        ("oracle: fitted to the ground truth", Box::new(fitted)),
    ];
    evaluate(
        ScoreTable::new("light", notes),
        (set, split),
        baselines,
        predictions,
        |found, sample| found.light(&sample.name),
        |sample, light| score(sample, light, form),
        progress,
    )
}

fn score(
    sample: &TruthSample,
    light: &ShLight,
    form: DiffuseForm,
) -> Result<Vec<ScoreLine>, EvalError> {
    let normals = need(sample, "normals", &sample.normals)?;
    let known = known(sample, normals);
    let found = DiffuseLayer::new(light, form).shading(normals);
    let truth = to_maximum_one(need(sample, "shading", &sample.shading)?, &known);
    let found = to_maximum_one(&found, &known);
    let [mse, smse, ssim] = compared(&sample.name, truth.planes(), found.planes(), &known)?;
    let line = |part, measures: &[(&str, f64)], colour, fit| {
        ScoreLine::of_image(part, measures, (colour, fit), MaskRule::Known)
    };
    let (colour, none) = ("linear RGB, both maxima 1", ScaleFit::None);
    let degrees = direction_error(sample, light)?;
    Ok(vec![
        line("shading", &[("MSE", mse), ("SSIM", ssim)], colour, none),
        line("shading", &[("SMSE", smse)], colour, ScaleFit::Image),
        line(
            "direction",
            &[("degrees", degrees)],
            "mean of the channels",
            none,
        ),
    ])
}

/// The angle between the directions of light and true light, degrees.
fn direction_error(sample: &TruthSample, found: &ShLight) -> Result<f64, EvalError> {
    let truth = match &sample.light {
        Some(light) => light.clone(),
        None => fitted(sample)?,
    };
    let cosine = match (direction(&truth), direction(found)) {
        (Some(truth), Some(found)) => truth.dot(found),
        _ => 0.0,
    };
    Ok(cosine.clamp(-1.0, 1.0).acos().to_degrees())
}

/// The main direction of the light: its band 1, averaged over the channels. `None` for even light.
fn direction(light: &ShLight) -> Option<Direction> {
    let [y, z, x] = [1, 2, 3].map(|at: usize| light.coefficients()[at].iter().sum::<f64>());
    Direction::new(x, y, z)
}

/// The image with its largest value under the mask brought to 1; unchanged where all is dark.
fn to_maximum_one(image: &Rgb<Linear>, mask: &[bool]) -> Rgb<Linear> {
    let most = largest(image, mask);
    Rgb::new(image.planes().clone().map(|value| value / most))
}
