//! Knows nothing of the solver.
//!
//! | file | concern |
//! | --- | --- |
//! | `crop` | the curves on the grid that the network is given, and back |
//! | `input` | the harmonics of the curves as the network's planes |
//! | `predict` | both together, in several hypotheses of the light's phase |

pub(crate) mod crop;
pub(crate) mod input;
pub(crate) mod predict;
