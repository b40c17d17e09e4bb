//! Relighting: one image of an object in, the same object under other lights out. The paper's table
//! has 100 objects under 30 lights each: from the image under one light to the 29 others, diffuse and
//! with highlights.

mod make;
mod method;
mod set;

pub use make::{RelightingRecipe, make_relighting};
pub use method::RelightMethod;
pub use set::RelightingSet;

use super::run::{add_lines, compared, each};
use super::{EvalError, EvalProgress, MaskRule, ScoreLine, ScoreTable};
use relight_core::metrics::{SSIM_WINDOW, ScaleFit, dssim};
use set::{Object, Part, object_folder};

/// MSE and DSSIM of relit images, for each method: the mean over all objects and target lights.
///
/// # Errors
/// If the set or a prediction cannot be read or measured.
pub fn evaluate_relighting(
    set: &RelightingSet,
    split: &str,
    methods: &[RelightMethod<'_>],
    progress: EvalProgress<'_>,
) -> Result<ScoreTable, EvalError> {
    let notes = vec![
        set.about(),
        "input: one image; output: the images under all other lights; images: how many were compared"
            .to_owned(),
        format!("SSIM by {}", SSIM_WINDOW),
    ];
    let mut table = ScoreTable::new("relighting", notes);
    let steps = methods.len() * set.objects();
    let progress = || progress(steps);
    let targets = set.lights().len().saturating_sub(1);
    for method in methods {
        let scored = each(set.objects(), &progress, object_folder, |number| {
            score(set, &set.object(number)?, method)
        })?;
        add_lines(&mut table, &method.name(), split, targets, scored);
    }
    Ok(table)
}

/// The lines of one object, means over its target lights.
fn score(
    set: &RelightingSet,
    object: &Object,
    method: &RelightMethod<'_>,
) -> Result<Vec<ScoreLine>, EvalError> {
    let whole = vec![true; object.mask.len()];
    let rules = [
        (&object.mask, MaskRule::Object),
        (&whole, MaskRule::WholeImage),
    ];
    let mut lines = Vec::new();
    for part in Part::ALL {
        let mut sums = [(0.0, 0.0); 2];
        let relight = method.prepare(set, object, part)?;
        for light in object.targets(set) {
            let truth = set.image(object, light, part)?;
            let found = relight(light)?;
            for ((mask, _), sum) in rules.iter().zip(&mut sums) {
                let [mse, _, ssim] = compared(&object.name, &truth, &found, mask)?;
                sum.0 += mse;
                sum.1 += dssim(ssim);
            }
        }
        let count = object.targets(set).count().max(1) as f64;
        for ((_, rule), sum) in rules.iter().zip(sums) {
            lines.push(ScoreLine::of_image(
                part.name(),
                &[("MSE", sum.0 / count), ("DSSIM", sum.1 / count)],
                ("sRGB, clipped to 0..1", ScaleFit::None),
                *rule,
            ));
        }
    }
    Ok(lines)
}
