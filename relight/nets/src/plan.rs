//! What an engine makes of a network.

use super::weights::Tensor;

/// A network in an engine, ready to be run.
pub(super) trait Plan: Send + Sync {
    /// The outputs for an input of the shape it was made ready for, or the engine's own words.
    fn run(&self, input: &[f32]) -> Result<Vec<Tensor>, String>;
}

/// A whole number that an input of a network always gets.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GivenNumber {
    /// The input's name.
    pub name: String,
    /// The number.
    pub value: i64,
}
