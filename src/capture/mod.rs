//! The capture: from a rig that stands still to a session folder that holds one whole turn.

pub mod rig;
pub mod serve;
pub mod state;
