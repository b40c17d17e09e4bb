//! The object while a lamp goes around it.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;

use relight_core::light::{Direction, Order, ShLight, basis};
use relight_core::render::{DiffuseForm, Look, SpecularForm, Surface, exposure_for};
use relight_photo::files::{MovieFormat, MovieWriter};

use crate::error::TurnError;

/// Parameters of the video.
struct MovieParameters {
    /// Number of frames. By convention: three seconds.
    frames: u32,
    /// Frames a second. By convention.
    rate: u32,
    /// Width of the lamp, radians. Derived: a smaller one has rings in light of [`Order::LAMP`].
    lamp_spread: f64,
    /// Height of the lamp above the line of sight, radians. By hand.
    lamp_height: f64,
}

const PARAMETERS: MovieParameters = MovieParameters {
    frames: 90,
    rate: 30,
    lamp_spread: 0.3,
    lamp_height: 0.6,
};

/// The object while a lamp goes around it once; `white`: the albedo that is shown as white.
pub(crate) fn write_movie(path: &Path, surface: &Surface, white: f32) -> Result<(), TurnError> {
    let lamp = lamp();
    let look = Look {
        diffuse: DiffuseForm::Irradiance,
        specular: SpecularForm::Lobe,
        exposure: exposure_for(&lamp) / white,
    };
    let extent = surface.extent();
    let mut movie = MovieWriter::create(path, MovieFormat::Mp4, extent, PARAMETERS.rate)?;
    for frame in 0..PARAMETERS.frames {
        let part = f64::from(frame) / f64::from(PARAMETERS.frames);
        movie.push(&look.turned(surface, &lamp, part)?.encode())?;
    }
    Ok(movie.finish()?)
}

/// A lamp high before the object, and weak light from everywhere.
fn lamp() -> ShLight {
    let from = Direction::from_angles(PARAMETERS.lamp_height, FRAC_PI_2);
    let mut light = ShLight::even(Order::LAMP, [0.15; 3]);
    let values = basis(Order::LAMP, from);
    let pairs = light.coefficients_mut().iter_mut().zip(values);
    for (at, (coefficient, value)) in pairs.enumerate() {
        let l = at.isqrt() as f64;
        let blur = (-0.5 * l * (l + 1.0) * PARAMETERS.lamp_spread * PARAMETERS.lamp_spread).exp();
        for channel in coefficient {
            *channel += TAU * blur * value;
        }
    }
    light
}

#[cfg(test)]
mod tests;
