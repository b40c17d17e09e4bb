//! Light of single images: the table on Light-Net.

use super::normals::known;
use super::run::{Scored, UNLIT, add_method, largest, measured, need};
use super::{EvalError, EvalProgress, MaskRule, Predictions, ScoreTable};
use relight_core::image::{Linear, Rgb};
use relight_core::light::{Direction, Order, ShLight};
use relight_core::metrics::{Comparison, SSIM_WINDOW, ScaleFit};
use relight_core::reader::{TruthSample, TruthSet};
use relight_core::render::{DiffuseForm, DiffuseLayer, fit_light};

/// The light of order 2 that is nearest to the true shading on the true normals.
fn fitted(sample: &TruthSample, known: &[bool]) -> Result<ShLight, EvalError> {
    let normals = need(sample, "normals", &sample.normals)?;
    let shading = need(sample, "shading", &sample.shading)?;
    let light = fit_light(normals, shading, known, 0.0);
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
    let mut table = ScoreTable::new("light", notes);
    let steps = (2 + predictions.len()) * set.names().len();
    let progress = || progress(steps);
    let mut add = |name: &str, light: &LightOf<'_>| {
        add_method(&mut table, (set, split), name, &progress, |sample| {
            let normals = need(sample, "normals", &sample.normals)?;
            let known = known(sample, normals);
            let light = light(sample, &known)?;
            let found = DiffuseLayer::new(&light, form).shading(normals);
            let mut lines = score(sample, &found, &known)?;
            lines.push(direction_score(sample, &light, &known)?);
            Ok(lines)
        })
    };
    add("even light", &|_, _| {
        Ok(ShLight::even(Order::TWO, [1.0; 3]))
    })?;
    add("oracle: fitted to the ground truth", &fitted)?;
    for found in predictions {
        add(&found.name(), &|sample, _| found.light(&sample.name))?;
    }
    Ok(table)
}

/// The light of a sample, whose normals are known in these pixels.
type LightOf<'a> = dyn Fn(&TruthSample, &[bool]) -> Result<ShLight, EvalError> + Sync + 'a;

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
    let ssim = measured(sample, pair.ssim())?;
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
