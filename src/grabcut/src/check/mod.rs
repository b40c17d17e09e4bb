//! A mask against a turn.

pub(crate) mod fit;
pub(crate) mod shape_faults;
