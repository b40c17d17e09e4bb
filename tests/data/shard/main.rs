//! The data set on disk, from outside: what is written is read back, and damage is named.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod damage;
mod description;
mod folder;
mod made;
mod write;
