//! The files of a solved turn.

pub(crate) mod contact_sheet;
pub(crate) mod files;
pub(crate) mod object;
pub(crate) mod warnings;
