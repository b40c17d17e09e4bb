//! In which precision a network is computed.

use serde::{Deserialize, Serialize};
use tch::Kind;

/// In which precision layers are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ComputePrecision {
    /// 32 bits.
    Single,
    /// bfloat16 inside convolutions, normalisations and layers; parameters and results have 32 bits.
    Mixed,
    /// 64 bits, parameters and results too, several times slower: for comparisons, in which rounding must not hide anything.
    /// Checkpoints keep 32 of them.
    Double,
}

impl ComputePrecision {
    /// The type of parameters, inputs and outputs.
    pub fn kind(self) -> Kind {
        match self {
            Self::Single | Self::Mixed => Kind::Float,
            Self::Double => Kind::Double,
        }
    }
}
