//! One file a verb: its arguments and its `run`.

pub(super) mod render;
