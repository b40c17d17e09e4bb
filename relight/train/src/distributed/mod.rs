//! Several processes that train together: their ranks, sums over them.

pub(crate) mod all_reduced;
pub(crate) mod launch;
pub(crate) mod process_group;
