//! Precomputed radiance transfer of an object on the turntable: the response of each pixel to light from all around, cast
//! once and then lit by any environment over a whole turn, without a ray.
//!
//! In the table's frame (x to the camera's right, y level and away from the camera, z up the axis) the light L and what
//! a pixel takes of it T are written in real spherical harmonics about the axis. With the pairs of order m as complex
//! numbers, `T_m = T_lm + i T_l-m`, a turn of the table by `a` is a phase of the light, and the pixel shows
//!
//! ```text
//! I(a) = c_0 + Re Σ_m c_m e^(i m a),    c_m = Σ_l T_lm conj(L_lm)
//! ```
//!
//! T of a Lambertian surface is the cosine's, known in closed form (Ramamoorthi and Hanrahan, "An Efficient Representation
//! for Irradiance Environment Maps", 2001), less the sum over the directions that the object or the plate block (Sloan,
//! Kautz and Snyder, "Precomputed Radiance Transfer", 2002).
//!
//! | file | concern |
//! | --- | --- |
//! | `cast` | the rays of a view |
//! | `environment_lights` | light to draw from |
//! | `photo_view` | a view for photographs: what a device needs to light it without a ray |
//! | `photo_plan` | the material, light and camera of one such photograph |
//! | `turn_view` | a view of an object on the table, likewise |
//! | `turn_plan` | the material, light and camera of a turn of one |
//! | `timing` | the table's angle as a rig knows it |

mod cast;
mod environment_lights;
mod photo_plan;
mod photo_view;
#[cfg(test)]
mod tests;
mod timing;
mod turn_plan;
mod turn_view;

use relight_core::light::Order;
use relight_core::render::cosine_lobe;

pub use environment_lights::EnvironmentLights;
pub use photo_plan::{PhotoCamera, PhotoGloss, PhotoLamp, PhotoPlan, PhotoPrint};
pub use photo_view::{PhotoView, ViewLamp};
pub use turn_plan::{CURVE_TERMS, CurveTerms, TurnMaterial, TurnPlan};
pub use turn_view::TurnView;

/// How views are drawn and cast. The same recipe and library give the same views.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ViewRecipe {
    /// The seed of all draws.
    pub seed: u64,
    /// Width and height, pixels.
    pub size: u32,
    /// Rays a pixel, all around; half of them leave the surface.
    pub rays: u32,
}

/// The order of the light: lamps are blurred by it, and gloss as smooth as varnish.
pub(crate) const TRANSFER_ORDER: Order = Order::LAMP;
/// Coefficients of that order.
const COEFFICIENTS: usize = TRANSFER_ORDER.coefficients();
/// Coefficients of what bounces: it is smooth.
const BOUNCE_COEFFICIENTS: usize = Order::TWO.coefficients();

/// The factor of a band from radiance to irradiance.
fn cosine_band(l: usize) -> f32 {
    cosine_lobe(l) as f32
}

/// The band of a coefficient.
fn band(coefficient: usize) -> usize {
    coefficient.isqrt()
}
