//! Knows nothing of the solver.
//!
//! | file | concern |
//! | --- | --- |
//! | `crop` | the curves on the grid that the network is given, and back |
//! | `input`, `limits` | the harmonics of the curves as the network's planes |
//! | `predict` | both together |

pub(crate) mod crop;
pub(crate) mod input;
pub mod limits;
pub(crate) mod predict;
