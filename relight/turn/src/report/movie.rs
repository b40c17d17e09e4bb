//! The object while a lamp goes around it.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;

use relight_core::light::{Direction, Order, ShLight, basis};
use relight_core::render::{DiffuseForm, Look, SpecularForm, Surface, exposure_for};
use relight_photo::files::{MovieFormat, MovieWriter};

use crate::error::TurnError;

/// Number of frames. By convention: three seconds.
const FRAMES: u32 = 90;
/// Frames a second. By convention.
const RATE: u32 = 30;
/// Width of the lamp, radians. Derived: a smaller one has rings in light of [`Order::LAMP`].
const LAMP_SPREAD: f64 = 0.3;
/// Height of the lamp above the line of sight, radians. By hand.
const LAMP_HEIGHT: f64 = 0.6;

/// The object while a lamp goes around it once; `white`: the albedo that is shown as white.
pub(crate) fn write_movie(path: &Path, surface: &Surface, white: f32) -> Result<(), TurnError> {
    let lamp = lamp();
    let look = Look {
        diffuse: DiffuseForm::Irradiance,
        specular: SpecularForm::Lobe,
        exposure: exposure_for(&lamp) / white,
    };
    let extent = surface.extent();
    let mut movie = MovieWriter::create(path, MovieFormat::Mp4, extent, RATE)?;
    for frame in 0..FRAMES {
        let part = f64::from(frame) / f64::from(FRAMES);
        movie.push(&look.turned(surface, &lamp, part)?.encode())?;
    }
    Ok(movie.finish()?)
}

/// A lamp high before the object, and weak light from everywhere.
fn lamp() -> ShLight {
    let from = Direction::from_angles(LAMP_HEIGHT, FRAC_PI_2);
    let mut light = ShLight::even(Order::LAMP, [0.15; 3]);
    let values = basis(Order::LAMP, from);
    let pairs = light.coefficients_mut().iter_mut().zip(values);
    for (at, (coefficient, value)) in pairs.enumerate() {
        let l = at.isqrt() as f64;
        let blur = (-0.5 * l * (l + 1.0) * LAMP_SPREAD * LAMP_SPREAD).exp();
        for channel in coefficient {
            *channel += TAU * blur * value;
        }
    }
    light
}

#[cfg(test)]
mod tests;
