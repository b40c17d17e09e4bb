//! Distant light and its directions. Knows nothing of rendering.
//!
//! The frame of everything here is the viewer's: x to the right, y up, z out of the image to the
//! viewer. A [`Panorama`]'s middle column is what the viewer sees behind the object (-z), its right
//! half is to the right (+x), its upper edge is the zenith (+y).
//!
//! The real spherical harmonics are orthonormal on the sphere, without the Condon-Shortley phase,
//! with z as their pole: `Y_1` = 0.4886 (y, z, x) for m = -1, 0, 1. Coefficient (l, m) stands at
//! index `l (l + 1) + m`. See [`Order`] and [`basis`].

mod basis;
mod coefficients;
mod direction;
mod error;
mod least_squares;
mod normals;
mod order;
mod panorama;
mod quadrature;
mod rotation;
mod wigner;

pub use basis::{basis, basis_into};
pub(crate) use basis::{legendre_step, polar_functions};
pub use coefficients::ShLight;
pub use direction::Direction;
pub use error::LightError;
pub use least_squares::NormalEquations;
pub use normals::{Normals, NormalsFrame};
pub use order::Order;
pub use panorama::{LightSample, LightSampler, Panorama};
pub(crate) use quadrature::Quadrature;
pub use rotation::Rotation;
