//! The object while a lamp goes around it.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;

use relight_core::files::{MovieFormat, MovieWriter};
use relight_core::light::{Direction, Order, ShLight, basis};
use relight_core::render::{DiffuseForm, Look, SpecularForm, Surface, exposure_for};

use crate::error::TurnError;

/// Frames of the video, and frames a second.
const MOVIE_FRAMES: u32 = 90;

const MOVIE_RATE: u32 = 30;

/// Order of the lamp that goes around the object in the video, how wide it is, radians: a smaller one would have rings in this
/// order, and how high it stands, radians.
const LAMP_ORDER: usize = 8;

const LAMP_SPREAD: f64 = 0.3;

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
    let mut movie = MovieWriter::create(path, MovieFormat::Mp4, extent, MOVIE_RATE)?;
    for frame in 0..MOVIE_FRAMES {
        let part = f64::from(frame) / f64::from(MOVIE_FRAMES);
        movie.push(&look.turned(surface, &lamp, part)?.encode())?;
    }
    Ok(movie.finish()?)
}

/// A lamp high before the object, and weak light from everywhere.
fn lamp() -> ShLight {
    let order = Order::new(LAMP_ORDER).unwrap_or(Order::TWO);
    let from = Direction::from_angles(LAMP_HEIGHT, FRAC_PI_2);
    let mut light = ShLight::even(order, [0.15; 3]);
    let values = basis(order, from);
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
