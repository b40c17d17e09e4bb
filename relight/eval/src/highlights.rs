//! Highlights of single images: the table on highlight separation.

use super::run::{compared, cut_out, evaluate, largest, need, object};
use super::{EvalError, EvalProgress, MaskRule, Predictions, ScoreLine, ScoreTable};
use relight_core::image::{Linear, Planes, Rgb, Srgb};
use relight_core::metrics::{SSIM_WINDOW, ScaleFit, dssim};
use relight_core::reader::{TruthSample, TruthSet};

/// MSE and DSSIM of the highlight, and of the image without it, for no highlight and for each prediction (part `highlight`, in
/// the image's units). Images are brought to a maximum of 1 and encoded as sRGB, in which highlights are seen.
///
/// # Errors
/// If the ground truth or a prediction cannot be read or measured.
pub fn evaluate_highlights(
    set: &TruthSet,
    split: &str,
    predictions: &[Predictions],
    progress: EvalProgress<'_>,
) -> Result<ScoreTable, EvalError> {
    let notes = vec![
        "highlight: against the true one; diffuse: the image less the highlight, not below 0, \
         against the image less the true one"
            .to_owned(),
        format!("SSIM by {}", SSIM_WINDOW),
    ];
    let none = |sample: &TruthSample| Ok(Rgb::new(Planes::zeros(sample.extent())));
    evaluate(
        ScoreTable::new("highlights", notes),
        (set, split),
        vec![("no highlight", Box::new(none))],
        predictions,
        |found, sample| found.colour(&sample.name, "highlight", sample.extent()),
        score,
        progress,
    )
}

fn score(sample: &TruthSample, found: &Rgb<Linear>) -> Result<Vec<ScoreLine>, EvalError> {
    let image = need(sample, "image", &sample.image)?;
    let truth = need(sample, "highlight", &sample.highlight)?;
    let mask = object(sample);
    let whole = vec![true; mask.len()];
    let gain = 1.0 / largest(image, &mask);
    let shown = |light: &Rgb<Linear>| {
        let scaled = Rgb::<Linear>::new(light.planes().clone().map(|value| value * gain));
        cut_out(scaled.encode::<Srgb>().planes(), &mask)
    };
    let parts = [
        ("highlight", shown(truth), shown(found)),
        (
            "diffuse",
            shown(&less(image, truth)),
            shown(&less(image, found)),
        ),
    ];
    let mut lines = Vec::new();
    for (part, truth, found) in &parts {
        for (mask, rule) in [(&mask, MaskRule::Object), (&whole, MaskRule::WholeImage)] {
            let [mse, _, ssim] = compared(&sample.name, truth, found, mask)?;
            lines.push(ScoreLine::of_image(
                part,
                &[("MSE", mse), ("DSSIM", dssim(ssim))],
                ("sRGB, image's maximum 1", ScaleFit::None),
                rule,
            ));
        }
    }
    Ok(lines)
}

/// The image without a highlight; not below 0.
fn less(image: &Rgb<Linear>, highlight: &Rgb<Linear>) -> Rgb<Linear> {
    let mut planes = image.planes().clone();
    let pairs = planes
        .planes_mut()
        .into_iter()
        .zip(highlight.planes().planes());
    for (plane, highlight) in pairs {
        for (value, &highlight) in plane.iter_mut().zip(highlight) {
            *value = (*value - highlight).max(0.0);
        }
    }
    Rgb::new(planes)
}
