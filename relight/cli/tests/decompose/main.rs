//! Photographs in, folders of layers out. But for one test, the network is not trained: they are about files, masks,
//! encodings and faults, not about how good the layers are.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

mod encodings;
mod faults;
mod forms;
mod masks;
mod networks;
mod program;
mod results;
mod support;
mod values;
