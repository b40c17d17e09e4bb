//! Data sets: what is written is read back, and damage is reported.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod damage;
mod description;
mod folder;
mod overview;
mod sample_set;
mod write;
