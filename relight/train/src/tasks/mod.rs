//! Networks and their losses: the network of photographs, the network of turns, the paper's phases.

pub(crate) mod decompose;
pub(crate) mod decompose_task;
pub(crate) mod low_rank;
pub(crate) mod paper_layers;
pub(crate) mod paper_networks;
pub(crate) mod paper_phases;
pub(crate) mod paper_task;
pub(crate) mod turn_task;
pub(crate) mod validation;
