//! The program `relit-extract`: command lines, results and failures.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod data_sets;
mod folders;
mod inputs;
mod runs;
mod support;
