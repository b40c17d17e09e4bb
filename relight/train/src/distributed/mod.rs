//! Several processes that train together: their ranks, sums over them.

pub(crate) mod agreement;
pub(crate) mod launch;
pub(crate) mod process_group;
