//! What is written of a solved turn.

pub(crate) mod files;
pub(crate) mod object;
pub(crate) mod sheet;
pub(crate) mod warnings;
