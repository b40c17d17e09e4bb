//! What networks learn from and are validated by: photographs lit on the device, views of turns, contact sheets.

pub(crate) mod contact_sheet;
pub(crate) mod photographs;
pub(crate) mod sample;
pub(crate) mod turn_reader;
pub(crate) mod turn_samples;
pub(crate) mod validation;
