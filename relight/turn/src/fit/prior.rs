//! Normals of a network, or of a file, to start from, and the albedo that networks see.

use std::path::{Path, PathBuf};

use relight_core::image::{Linear, Planes, Rgb};
use relight_core::light::{Normals, NormalsFrame, YDown, YUp};
use relight_core::statistics::median;
use relight_photo::decompose::{DecomposeError, DecomposeOptions, Decomposer, SpecularGate};
use relight_photo::nets::{NetError, Weights};

use crate::error::TurnError;

/// Where normals come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NormalsSource {
    /// The decomposing network with the weights that the caller has.
    Own,
    /// That network with other weights.
    Weights(PathBuf),
    /// Another network, as an ONNX file: see [`Decomposer::set_normals`].
    Onnx(PathBuf),
    /// A map of normals, PNG or EXR.
    Map(PathBuf),
}

impl NormalsSource {
    /// What a path names: a map of normals (.png, .exr), a folder with a map `normal`, an ONNX file, or weights
    /// (.safetensors).
    #[must_use]
    pub fn of(path: &Path) -> Self {
        let has = |ending: &str| {
            path.extension()
                .is_some_and(|found| found.eq_ignore_ascii_case(ending))
        };
        if path.is_dir() {
            let exr = path.join("normal.exr");
            let map = if exr.is_file() {
                exr
            } else {
                path.join("normal.png")
            };
            return Self::Map(map);
        }
        if has("onnx") {
            Self::Onnx(path.to_owned())
        } else if has("png") || has("exr") {
            Self::Map(path.to_owned())
        } else {
            Self::Weights(path.to_owned())
        }
    }
}

/// Parameters of the expected albedo.
struct AlbedoParameters {
    /// Frames that are decomposed, spread over the turn. Measured: with twelve the error is no less.
    frames: usize,
    /// The least albedo that counts: darker ones are noise. Numerical.
    darkest: f32,
}

const PARAMETERS: AlbedoParameters = AlbedoParameters {
    frames: 4,
    darkest: 1e-4,
};

/// The albedo of the decomposing network: the geometric mean over a few frames of the turn, each of which the network
/// sees in another light. Its unit is not known.
///
/// # Errors
/// Where the network fails.
pub fn prior_albedo(
    weights: &Weights,
    frames: &[Rgb<Linear>],
    mask: &Planes<1>,
) -> Result<Rgb<Linear>, TurnError> {
    let decomposer = Decomposer::new(weights)?;
    let every = frames.len().div_ceil(PARAMETERS.frames).max(1);
    let chosen = frames.iter().step_by(every);
    let part = 1.0 / chosen.len() as f32;
    let mut logarithms = Planes::<3>::zeros(mask.extent());
    for picture in chosen {
        let found = decomposer.decompose(picture, mask, &without_gate())?;
        let pairs = logarithms
            .planes_mut()
            .into_iter()
            .zip(found.albedo.planes().planes());
        for (sum, plane) in pairs {
            sum.iter_mut()
                .zip(plane)
                .for_each(|(sum, value)| *sum += part * value.max(PARAMETERS.darkest).ln());
        }
    }
    Ok(Rgb::new(logarithms.map(f32::exp)))
}

/// The geometric mean of two albedos of one object, each in units of its own: each channel has the median of the first under
/// the mask. Two networks that look at other things, a picture and its changes over the turn, err in other places.
pub(crate) fn mean_albedo(one: &Rgb<Linear>, other: &Rgb<Linear>, mask: &Planes<1>) -> Rgb<Linear> {
    let logarithm = |value: f32| value.max(PARAMETERS.darkest).ln();
    let mut mean = one.planes().clone();
    for (plane, other) in mean.planes_mut().into_iter().zip(other.planes().planes()) {
        let pixels = plane.iter().zip(other).zip(mask.plane(0));
        let inside = pixels.filter(|(_, covered)| **covered >= 0.5);
        let apart = inside.map(|((one, other), _)| f64::from(logarithm(*one) - logarithm(*other)));
        let unit = median(apart).unwrap_or(0.0) as f32;
        for (value, other) in plane.iter_mut().zip(other) {
            *value = logarithm(*value).midpoint(logarithm(*other) + unit).exp();
        }
    }
    Rgb::new(mean)
}

/// How frames of a turn are decomposed.
fn without_gate() -> DecomposeOptions {
    DecomposeOptions {
        specular: SpecularGate::Off,
        ..DecomposeOptions::default()
    }
}

/// The normals of a file, or the mean of a network's over some frames of the turn. `own` gives the caller's weights of
/// the decomposing network.
///
/// # Errors
/// Where a file cannot be read or the network fails.
pub fn prior_normals(
    source: &NormalsSource,
    own: impl FnOnce() -> Result<Weights, NetError>,
    frame: NormalsFrame,
    frames: &[Rgb<Linear>],
    mask: &Planes<1>,
) -> Result<Normals<YUp>, TurnError> {
    let decomposer = match source {
        NormalsSource::Map(path) => {
            return Ok(match frame {
                NormalsFrame::YUp => Normals::<YUp>::read(path)?,
                NormalsFrame::YDown => Normals::<YDown>::read(path)?.flipped(),
            });
        }
        NormalsSource::Own => Decomposer::new(&own().map_err(DecomposeError::from)?)?,
        NormalsSource::Weights(path) => {
            Decomposer::new(&Weights::read(path).map_err(DecomposeError::from)?)?
        }
        NormalsSource::Onnx(path) => {
            let mut decomposer = Decomposer::new(&own().map_err(DecomposeError::from)?)?;
            // Up is what is assumed where nobody says anything; networks that are known have their own axes.
            let said = (frame == NormalsFrame::YDown).then_some(frame);
            decomposer.read_normals(path, said)?;
            decomposer
        }
    };
    let mut sums = Planes::<3>::zeros(mask.extent());
    for picture in frames {
        let found = decomposer.decompose(picture, mask, &without_gate())?;
        let pairs = sums
            .planes_mut()
            .into_iter()
            .zip(found.normals.planes().planes());
        for (sum, plane) in pairs {
            sum.iter_mut()
                .zip(plane)
                .for_each(|(sum, value)| *sum += value);
        }
    }
    Ok(Normals::new(sums))
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::image::Extent;

    fn are_alike(a: &Rgb<Linear>, b: &Rgb<Linear>) -> bool {
        let [a, b] = [a, b].map(|image| image.planes().planes().into_iter().flatten());
        a.zip(b).all(|(a, b)| (a / b - 1.0).abs() < 1e-5)
    }

    #[test]
    fn the_mean_of_two_albedos_does_not_depend_on_the_unit_of_the_second() {
        let extent = Extent::new(20, 10);
        let mask = Planes::filled(extent, [1.0]);
        let one = Rgb::new(Planes::from_fn(extent, |x, _| {
            [0.1 + 0.02 * x as f32, 0.4, 0.3]
        }));
        let other = |unit: f32| {
            Rgb::new(Planes::from_fn(extent, |x, y| {
                [0.2 + 0.01 * x as f32, 0.2 + 0.03 * y as f32, 0.3].map(|value| unit * value)
            }))
        };
        let (found, again) = (
            mean_albedo(&one, &other(1.0), &mask),
            mean_albedo(&one, &other(5.0), &mask),
        );
        assert!(are_alike(&found, &again));
        // What both say alike stays.
        assert!(are_alike(&mean_albedo(&one, &one, &mask), &one));
    }
}
