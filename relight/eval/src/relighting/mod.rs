//! Relighting: one image of an object in, the same object under other lights out. The paper's table
//! has 100 objects under 30 lights each: from the image under one light to the 29 others, diffuse and
//! with highlights.

mod make;
mod method;
mod set;

pub use make::{RelightingRecipe, make_relighting};
pub use method::RelightMethod;
pub use set::RelightingSet;

use super::run::{NOT_MEASURED, Scored, add_lines, each};
use super::{EvalError, EvalProgress, MaskRule, ScoreTable};
use relight_core::image::Planes;
use relight_core::metrics::{Comparison, SSIM_WINDOW, ScaleFit, dssim};
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
) -> Result<Vec<Scored>, EvalError> {
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
                let (mse, dssim) = compare(object, &truth, &found, mask)?;
                sum.0 += mse;
                sum.1 += dssim;
            }
        }
        let count = object.targets(set).count().max(1) as f64;
        for ((_, rule), sum) in rules.iter().zip(sums) {
            lines.push(Scored {
                part: part.name(),
                measures: vec![("MSE", sum.0 / count), ("DSSIM", sum.1 / count)],
                colour: "sRGB, clipped to 0..1",
                scale: ScaleFit::None.name(),
                mask: *rule,
            });
        }
    }
    Ok(lines)
}

fn compare(
    object: &Object,
    truth: &Planes<3>,
    found: &Planes<3>,
    mask: &[bool],
) -> Result<(f64, f64), EvalError> {
    let (truth_planes, found_planes) = (truth.planes(), found.planes());
    let pair = Comparison::new(truth.extent(), &truth_planes, &found_planes, mask);
    let failed = || EvalError::sample(&object.name, NOT_MEASURED);
    let pair = pair.map_err(failed())?;
    let ssim = pair.ssim().map_err(failed())?;
    Ok((pair.mse(ScaleFit::None), dssim(ssim)))
}
