//! Normals by the network of turns: its input from a turn's curves, its answer as normals with an expected error.
//! Knows nothing of the solver.
//!
//! | file | concern |
//! | --- | --- |
//! | `input` | the harmonics of the curves as the network's planes |
//! | `answer` | the network's planes as normals and expected errors |

pub(crate) mod answer;
pub(crate) mod input;
