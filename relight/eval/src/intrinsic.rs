//! Albedo and shading of single images: the table on MIT Intrinsic Images.

use super::run::{NOT_MEASURED, UNLIT, evaluate, grey, need, object, of_grey};
use super::{EvalError, EvalProgress, MaskRule, Predictions, ScoreLine, ScoreTable};
use relight_core::image::{Linear, Planes, Rgb};
use relight_core::metrics::{Convention, IntrinsicError, Windows, intrinsic_error};
use relight_core::reader::{TruthSample, TruthSet};
use relight_core::render::{DiffuseForm, DiffuseLayer, fit_light};

/// Which image is decomposed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum IntrinsicInput {
    /// The one without highlights.
    Diffuse,
    /// What the camera saw.
    Original,
}

/// A decomposition that needs no learning, or that looks at the ground truth.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Baseline {
    /// Albedo 1; the shading is the mean of the image's channels.
    ConstantAlbedo,
    /// Shading 1; the albedo is the image.
    ConstantShading,
    /// The shading is the mean of the image's channels, the albedo the remaining colour.
    LuminanceShading,
    /// The shading is the square root of that mean.
    RootShading,
    /// Not a baseline but a bound: the true normals under the light of order 2 that fits the true
    /// shading best. The shading is at least a fifth of its mean.
    Oracle,
}

impl Baseline {
    /// All of them, as a table names them.
    const ALL: [(Self, &str); 5] = [
        (Self::ConstantAlbedo, "constant albedo"),
        (Self::ConstantShading, "constant shading"),
        (Self::LuminanceShading, "shading = luminance"),
        (Self::RootShading, "shading = root of luminance"),
        (Self::Oracle, "oracle: true normals, fitted light"),
    ];

    fn decompose(
        self,
        sample: &TruthSample,
        image: &Rgb<Linear>,
        mask: &[bool],
    ) -> Result<IntrinsicImages, EvalError> {
        let extent = image.planes().extent();
        let ones = || of_grey(extent, vec![1.0; extent.pixels()]);
        let shaded_by = |shading: Vec<f32>| {
            Ok(IntrinsicImages {
                albedo: divided(image, &shading),
                shading: Some(of_grey(extent, shading)?),
            })
        };
        match self {
            Self::ConstantAlbedo => Ok(IntrinsicImages {
                albedo: ones()?,
                shading: Some(of_grey(extent, grey(image))?),
            }),
            Self::ConstantShading => Ok(IntrinsicImages {
                albedo: image.clone(),
                shading: Some(ones()?),
            }),
            Self::LuminanceShading => shaded_by(grey(image)),
            Self::RootShading => shaded_by(grey(image).into_iter().map(f32::sqrt).collect()),
            Self::Oracle => shaded_by(fitted_shading(sample, mask)?),
        }
    }
}

/// An image as albedo times shading; the shading may be unknown.
struct IntrinsicImages {
    albedo: Rgb<Linear>,
    shading: Option<Rgb<Linear>>,
}

/// The image divided by a shading; 0 where the shading is.
fn divided(image: &Rgb<Linear>, shading: &[f32]) -> Rgb<Linear> {
    let mut planes: Planes<3> = image.planes().clone();
    for plane in planes.planes_mut() {
        for (value, &shading) in plane.iter_mut().zip(shading) {
            *value = if shading > 0.0 { *value / shading } else { 0.0 };
        }
    }
    Rgb::new(planes)
}

/// The grey shading of the true normals under the light that fits the true shading best.
fn fitted_shading(sample: &TruthSample, mask: &[bool]) -> Result<Vec<f32>, EvalError> {
    let normals = need(sample, "normals", &sample.normals)?.completed(mask);
    let shading = need(sample, "shading", &sample.shading)?;
    let light = fit_light(&normals, shading, mask, 0.0);
    let light = light.map_err(EvalError::sample(&sample.name, UNLIT))?;
    let mut found = grey(&DiffuseLayer::new(&light, DiffuseForm::Irradiance).shading(&normals));
    let (count, sum) = found
        .iter()
        .zip(mask)
        .filter(|(_, inside)| **inside)
        .fold((0, 0.0_f64), |(count, sum), (&value, _)| {
            (count + 1, sum + f64::from(value))
        });
    let least = (sum / f64::from(count.max(1)) * MIN_SHADING) as f32;
    for value in &mut found {
        *value = value.max(least);
    }
    Ok(found)
}

/// The least shading of the oracle, as a fraction of the mean.
const MIN_SHADING: f64 = 0.2;

/// SMSE and LMSE of albedo and shading, and their means, by both conventions, for each baseline and each prediction (parts
/// `albedo` and `shading`). Of a set that does not know its shading, of albedo alone.
///
/// # Errors
/// If the ground truth or a prediction cannot be read or measured.
pub fn evaluate_intrinsic(
    set: &TruthSet,
    split: &str,
    input: IntrinsicInput,
    predictions: &[Predictions],
    progress: EvalProgress<'_>,
) -> Result<ScoreTable, EvalError> {
    let mut table = ScoreTable::new("intrinsic images", notes(input));
    let first = (set.names().len() > 0).then(|| set.load(0)).transpose()?;
    let has_oracle = first.is_none_or(|one| one.shading.is_some() && one.normals.is_some());
    let mut baselines = Baseline::ALL.to_vec();
    if !has_oracle {
        let note = "the oracle is left out: the set does not have both normals and shading";
        table.notes.push(note.to_owned());
        baselines.retain(|(baseline, _)| *baseline != Baseline::Oracle);
    }
    let images = |baseline: Baseline| {
        move |sample: &TruthSample| {
            let image = match input {
                IntrinsicInput::Diffuse => {
                    need(sample, "image without highlights", &sample.diffuse)
                }
                IntrinsicInput::Original => need(sample, "image", &sample.image),
            };
            baseline.decompose(sample, image?, &object(sample))
        }
    };
    let baselines = baselines.into_iter();
    let baselines = baselines.map(|(baseline, name)| (name, Box::new(images(baseline)) as _));
    evaluate(
        table,
        (set, split),
        baselines.collect(),
        predictions,
        |found, sample| {
            let (name, extent) = (&sample.name, sample.extent());
            let shading = sample.shading.as_ref();
            let shading = shading.map(|_| found.colour(name, "shading", extent));
            Ok(IntrinsicImages {
                albedo: found.colour(name, "albedo", extent)?,
                shading: shading.transpose()?,
            })
        },
        score,
        progress,
    )
}

fn notes(input: IntrinsicInput) -> Vec<String> {
    let input = match input {
        IntrinsicInput::Diffuse => "the image without highlights",
        IntrinsicInput::Original => "the image as it was taken",
    };
    vec![
        format!("input of the baselines: {input}"),
        "SMSE: squared error after the fitted scale, mean over pixels; LMSE: windows of 20 at step 10, \
         error and energy summed over windows"
            .to_owned(),
    ]
}

fn score(sample: &TruthSample, found: &IntrinsicImages) -> Result<Vec<ScoreLine>, EvalError> {
    let (albedo, mask) = (need(sample, "albedo", &sample.albedo)?, object(sample));
    let mut lines = Vec::new();
    for convention in Convention::ALL {
        let compare = |truth: &Rgb<Linear>, estimate: &Rgb<Linear>| {
            let (truth, estimate) = (truth.planes().planes(), estimate.planes().planes());
            let extent = sample.extent();
            let error = intrinsic_error(
                convention,
                extent,
                &truth,
                &estimate,
                &mask,
                Windows::GROSSE,
            );
            error.map_err(EvalError::sample(&sample.name, NOT_MEASURED))
        };
        let of_albedo = compare(albedo, &found.albedo)?;
        let mut parts = vec![("albedo", of_albedo)];
        if let (Some(shading), Some(found)) = (&sample.shading, &found.shading) {
            let of_shading = compare(shading, found)?;
            let mean = IntrinsicError {
                smse: f64::midpoint(of_albedo.smse, of_shading.smse),
                lmse: f64::midpoint(of_albedo.lmse, of_shading.lmse),
            };
            parts.extend([("shading", of_shading), ("mean", mean)]);
        }
        for (part, error) in parts {
            lines.push(ScoreLine::of_image(
                part,
                &[("SMSE", error.smse), ("LMSE", error.lmse)],
                (values_of(convention), convention.fit()),
                MaskRule::Object,
            ));
        }
    }
    Ok(lines)
}

const fn values_of(convention: Convention) -> &'static str {
    match convention {
        Convention::Strict => "strict: linear grey, truth's maximum 1",
        Convention::FileUnits => "file units: linear RGB as in the file",
    }
}
