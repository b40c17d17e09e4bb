//! Light on what a geometry buffer shows: lamps with attached and cast shadows, panoramas, ambient and
//! bounced light. Knows neither meshes nor cameras.
//!
//! A picture is `albedo x shading + highlight`, as the paper has it: shading is irradiance (even light
//! of radiance 1 gives pi), a highlight is Blinn and Phong's without a cosine.
//!
//! | file | concern |
//! | --- | --- |
//! | `lamp` | one lamp: its rays, its shadows |
//! | `environment` | light from all around: by order-2 coefficients, or by rays |
//! | `shaded` | shading and highlight of a surface; each kind of light is added separately |
//! | `scene` | a buffer with what blocks its light; whole lightings |
//! | `draw` | random lightings |

mod draw;
mod environment;
mod lamp;
mod scene;
mod shaded;
pub(crate) mod studio;
#[cfg(test)]
mod tests;

use glam::Vec3;
use serde::{Deserialize, Serialize};

pub use draw::LightKind;
pub(crate) use draw::tint;
pub use environment::Panoramas;
pub(crate) use environment::{Environment, Method};
pub(crate) use lamp::{Emitter, SyntheticLamp};
pub use scene::SyntheticScene;
pub use shaded::{BlinnPhong, Material, Shaded};

use relight_core::light::{Direction, Order, Rotation, ShLight};

/// All light on an object. Colours are linear red, green and blue.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Lighting {
    /// Lamps, each with its shadows.
    pub(crate) lamps: Vec<SyntheticLamp>,
    /// A panorama around the object.
    pub(crate) environment: Option<Environment>,
    /// Irradiance of even light from all around.
    pub(crate) ambient: Vec3,
    /// Light from the object's own lit parts in its hollows, as a factor of what they send back: 1 where all of
    /// it arrives.
    pub(crate) bounce: Vec3,
    /// Whether the object blocks light: without, there are neither cast shadows nor dark hollows.
    pub(crate) has_shadows: bool,
}

impl Lighting {
    /// A panorama by rays, at an angle about the vertical (radians); `irradiance` is the mean over all normals.
    pub fn from_panorama(panorama: usize, turn: f64, irradiance: f32, has_shadows: bool) -> Self {
        let environment = Environment {
            panorama,
            rotation: *Rotation::about(Direction::UP, turn).matrix(),
            irradiance: Vec3::splat(irradiance),
            method: Method::MonteCarlo,
        };
        Self {
            environment: Some(environment),
            has_shadows,
            ..Self::default()
        }
    }

    /// All light except what bounces, as coefficients of an order: without shadows, their
    /// diffuse layer is the shading, smoothed where lamps are.
    pub fn coefficients(&self, order: Order, panoramas: &Panoramas) -> ShLight {
        let even = self
            .ambient
            .to_array()
            .map(|e| f64::from(e) / std::f64::consts::PI);
        let mut sum = ShLight::even(order, even);
        for lamp in &self.lamps {
            sum.add(&lamp.coefficients(order), [1.0; 3]);
        }
        if let Some(environment) = &self.environment {
            sum.add(&environment.coefficients(order, panoramas), [1.0; 3]);
        }
        sum
    }

    /// All light, turned about the origin.
    pub(crate) fn turned(&self, turn: &Rotation) -> Self {
        Self {
            lamps: self.lamps.iter().map(|lamp| lamp.turned(turn)).collect(),
            environment: self.environment.as_ref().map(|around| around.turned(turn)),
            ..self.clone()
        }
    }

    /// The same light with every lamp above the horizon of this vertical: lamps below are mirrored.
    pub(super) fn above(mut self, vertical: Vec3) -> Self {
        for lamp in &mut self.lamps {
            lamp.emitter = lamp.emitter.above(vertical);
        }
        self
    }
}
