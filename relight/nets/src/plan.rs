//! What an engine makes of a network.

use super::weights::Tensor;

/// A network in an engine, ready to be run.
pub(super) trait Plan: Send + Sync {
    /// The outputs for an input of the shape it was made ready for, or the engine's own words.
    fn run(&self, input: &[f32]) -> Result<Vec<Tensor>, String>;
}
