//! What a turn says of its own frames, for the networks to learn from.

use std::path::Path;

use relight_core::files::{ResultFolder, write_png};
use relight_core::image::{Depth, Linear, Planes, Rgb, Srgb};
use relight_core::light::Normals;
use serde::Serialize;

use crate::error::TurnError;
use crate::fit::residuals::lit;
use crate::fit::solution::TurnSolution;
use crate::model::harmonics::basis_at;
use crate::model::material::MaterialKind;
use crate::observe::reading::ReadTurn;
use crate::report::encoding::write_json;

/// The file that says what the folder is.
const ABOUT: &str = "labels.json";

/// Beside it there is a folder a frame, of two digits.
const RESULTS: ResultFolder = ResultFolder {
    marker: ABOUT,
    holds: |name| name == ABOUT || (name.len() == 2 && name.parse::<u8>().is_ok()),
};

/// What it says it is.
const SCHEMA: &str = "relight.labels/1";

/// The first frames of a turn with what was found as their truth, where it is to be trusted.
#[derive(Debug, Clone, Copy)]
pub struct TurnLabels<'a> {
    /// What was read.
    pub turn: &'a ReadTurn,
    /// What was found.
    pub solution: &'a TurnSolution,
    /// The least confidence of a pixel that is written: others are outside the mask.
    pub least_confidence: f32,
}

#[derive(Serialize)]
struct About<'a> {
    schema: &'static str,
    turn: &'a str,
    least_confidence: f32,
    /// The part of the object whose confidence suffices.
    part: f64,
}

#[derive(Serialize)]
struct Description<'a> {
    turn: &'a str,
    angle_deg: f64,
    white: Whites,
}

/// The light that the largest value of a file stands for.
#[derive(Serialize)]
struct Whites {
    shading: f32,
    highlight: f32,
}

/// A frame and what is said of it.
struct Label {
    image: Planes<3>,
    shading: Planes<3>,
    highlight: Planes<3>,
}

impl TurnLabels<'_> {
    /// Whether labels may be written to the folder `out`: it is not there, empty, or holds earlier labels and nothing
    /// else.
    ///
    /// # Errors
    /// Where it holds something else or cannot be read.
    pub fn check(out: &Path) -> Result<(), TurnError> {
        Ok(RESULTS.check(out)?)
    }

    /// Why there is nothing to write: normals are not observable, the object is metal, or no pixel is confident.
    #[must_use]
    pub fn refusal(&self) -> Option<TurnError> {
        if !self.solution.conditioning().verdict.is_fit() {
            return Some(TurnError::NotObservable);
        }
        if self.solution.material() == MaterialKind::Metal {
            return Some(TurnError::NoDiffusePart);
        }
        let confidence = self.solution.confidence(&self.turn.curves);
        let most = confidence.plane(0).iter().copied().fold(0.0, f32::max);
        (most < self.least_confidence).then_some(TurnError::NotConfident {
            least: self.least_confidence,
            most,
        })
    }

    /// Writes a folder in the layout of `relight synth`, one sample a frame, which appears when it is whole; earlier
    /// labels in it are replaced. Returns how many samples there are.
    ///
    /// # Errors
    /// For a [`Self::refusal`], or where the folder holds something else or a file cannot be written: then the folder
    /// is as it was.
    pub fn write(&self, out: &Path) -> Result<usize, TurnError> {
        if let Some(refusal) = self.refusal() {
            return Err(refusal);
        }
        RESULTS.write(out, |folder| self.write_samples(folder))
    }

    fn write_samples(&self, folder: &Path) -> Result<usize, TurnError> {
        let curves = &self.turn.curves;
        let confidence = self.solution.confidence(curves);
        let object = self.turn.mask.plane(0).iter();
        let confident: Vec<f32> = object
            .zip(confidence.plane(0))
            .map(|(&mask, &found)| {
                f32::from(u8::from(mask >= 0.5 && found >= self.least_confidence))
            })
            .collect();
        let part = f64::from(confident.iter().sum::<f32>()) / curves.pixels() as f64;
        let mask = Planes::from_planes(curves.extent(), [confident])?;
        let albedo = masked(self.solution.fitted_albedo(curves).planes(), &mask);
        // Files of albedo end at 1: what is larger is given to the light.
        let most = largest(&albedo).max(1.0);
        let albedo = albedo.map(|value| value / most);
        let normals = self.solution.normals(curves).masked(&mask)?;
        let frames = self.turn.first.iter().zip(&self.turn.first_angles);
        for (at, (frame, &angle)) in frames.enumerate() {
            let sample = folder.join(format!("{at:02}"));
            std::fs::create_dir(&sample).map_err(TurnError::write(&sample))?;
            let label = self.label(frame, angle.to_radians(), &mask, (&albedo, most));
            self.write_sample(&sample, angle, &label, (&mask, &normals, &albedo))?;
            let mut light = self.solution.light_at(angle.to_radians())?;
            for value in light.coefficients_mut().iter_mut().flatten() {
                *value *= f64::from(most);
            }
            light.write(&sample.join("light.txt"))?;
        }
        let about = About {
            schema: SCHEMA,
            turn: &self.turn.name,
            least_confidence: self.least_confidence,
            part,
        };
        write_json(&folder.join(ABOUT), &about)?;
        Ok(self.turn.first.len())
    }

    /// Shading by the diffuse part of the light, and as highlight what the frame has beyond it.
    fn label(
        &self,
        frame: &Rgb<Linear>,
        angle: f64,
        mask: &Planes<1>,
        (albedo, most): (&Planes<3>, f32),
    ) -> Label {
        let basis = basis_at(angle);
        let model = &self.solution.model;
        let shading = self.turn.curves.map(|pixel| {
            let [diffuse, _] = lit(model, self.solution.fits[pixel].normal, &basis);
            diffuse.map(|value| value.max(0.0) as f32 * most)
        });
        let shading = masked(&shading, mask);
        let image = masked(frame.planes(), mask);
        let mut highlight = image.clone();
        let parts = albedo.planes().into_iter().zip(shading.planes());
        for (plane, (albedo, shading)) in highlight.planes_mut().into_iter().zip(parts) {
            for (value, (albedo, shading)) in plane.iter_mut().zip(albedo.iter().zip(shading)) {
                *value = (*value - albedo * shading).max(0.0);
            }
        }
        Label {
            image,
            shading,
            highlight,
        }
    }

    fn write_sample(
        &self,
        folder: &Path,
        angle_deg: f64,
        label: &Label,
        (mask, normals, albedo): (&Planes<1>, &Normals<relight_core::light::YUp>, &Planes<3>),
    ) -> Result<(), TurnError> {
        let path = |name: &str| folder.join(name);
        let image = Rgb::<Linear>::new(label.image.clone()).encode::<Srgb>();
        write_png(&path("image.png"), image.planes(), Depth::Eight)?;
        let [values] = mask.planes();
        let grey =
            Planes::from_planes(mask.extent(), [values, values, values].map(<[f32]>::to_vec))?;
        write_png(&path("mask.png"), &grey, Depth::Eight)?;
        normals.write_png(&path("normal.png"), Depth::Sixteen)?;
        write_png(&path("albedo.png"), albedo, Depth::Sixteen)?;
        let description = Description {
            turn: &self.turn.name,
            angle_deg,
            white: Whites {
                shading: write_over_white(&path("shading.png"), &label.shading)?,
                highlight: write_over_white(&path("highlight.png"), &label.highlight)?,
            },
        };
        write_json(&path("sample.json"), &description)
    }
}

/// Writes linear values over the largest of them, which it returns.
fn write_over_white(path: &Path, planes: &Planes<3>) -> Result<f32, TurnError> {
    let most = largest(planes);
    let white = if most > 0.0 { most } else { 1.0 };
    let part = planes.clone().map(|value| value / white);
    write_png(path, &part, Depth::Sixteen)?;
    Ok(white)
}

pub(crate) fn largest(planes: &Planes<3>) -> f32 {
    let values = planes.planes().into_iter().flatten();
    values.fold(0.0_f32, |most, &value| most.max(value))
}

fn masked(planes: &Planes<3>, mask: &Planes<1>) -> Planes<3> {
    let mut masked = planes.clone();
    for plane in masked.planes_mut() {
        for (value, mask) in plane.iter_mut().zip(mask.plane(0)) {
            *value *= mask;
        }
    }
    masked
}

#[cfg(test)]
mod tests;
