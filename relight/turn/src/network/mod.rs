//! Normals by the network of turns: its input from a turn's curves, its answer as normals with an expected error.
//! Knows nothing of the solver.
//!
//! | file | concern |
//! | --- | --- |
//! | `crop` | the curves on the grid that the network is given, and back |
//! | `input` | the harmonics of the curves as the network's planes |
//! | `answer` | the network's planes as normals and expected errors |
//! | `predict` | both together, in several hypotheses of the light's phase |

pub(crate) mod answer;
pub(crate) mod crop;
pub(crate) mod input;
pub(crate) mod predict;
