//! The data set on disk.
pub mod record;
