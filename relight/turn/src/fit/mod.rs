//! Normals, albedo and light that fit the curves.

pub(crate) mod albedo;
pub(crate) mod alternation;
pub(crate) mod azimuth;
pub(crate) mod blocks;
pub(crate) mod confidence;
pub(crate) mod curve_statistics;
pub(crate) mod environment;
pub(crate) mod figures;
pub(crate) mod given_light;
pub(crate) mod inflation;
pub(crate) mod initialisation;

pub(crate) mod joint;
pub(crate) mod material_choice;
pub(crate) mod normal_step;
pub(crate) mod options;
pub(crate) mod prior;
pub(crate) mod prior_mean;
pub(crate) mod prior_weight;
pub(crate) mod probe_check;
pub(crate) mod probe_light;
pub(crate) mod residuals;
pub(crate) mod robust;
pub(crate) mod rotation;
pub(crate) mod schur;
pub(crate) mod search;
pub(crate) mod setting;
pub(crate) mod smoothing;
pub(crate) mod solution;
pub(crate) mod solve;
pub(crate) mod unknowns;
