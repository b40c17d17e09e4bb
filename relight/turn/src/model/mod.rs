//! The forward model: what a pixel of known normal and material shows of an environment light while the table turns.

pub(crate) mod directions;
pub(crate) mod frame;
pub(crate) mod harmonics;
pub(crate) mod lighting;
pub(crate) mod material;
pub(crate) mod shading;
