//! Samples: the draws from a seed, the picture with its ground truth, and a folder of them.

pub(crate) mod camera;
pub(crate) mod finish;
pub(crate) mod folder;
pub(crate) mod object;
pub(crate) mod png;
pub(crate) mod recipe;
pub(crate) mod sample;
