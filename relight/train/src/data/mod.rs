//! What networks learn from: photographs lit on the device, views of turns.

pub(crate) mod photographs;
pub(crate) mod sample;
pub(crate) mod symmetry;
pub(crate) mod synthetic_turns;
pub(crate) mod turn_reader;
