//! What networks learn from: photographs and turns that are lit on the device, frames of recorded turns.
//!
//! | file | concern |
//! | --- | --- |
//! | `photographs`, `turns` | batches of a run |
//! | `view_pool`, `view_loader`, `view_ring` | processor cores cast views once; which of them a step draws from, on the device |
//! | `direction_maps`, `noise` | what lighting them is made of |
//! | `symmetry`, `sample` | photographs as the networks see them |
//! | `turn_reader` | frames of shards |

mod direction_maps;
mod noise;
pub(crate) mod photographs;
pub(crate) mod sample;
pub(crate) mod symmetry;
pub(crate) mod turn_reader;
pub(crate) mod turns;
mod view_loader;
mod view_pool;
mod view_ring;
