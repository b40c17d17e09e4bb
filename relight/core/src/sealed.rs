//! Keeps the traits that mark types to the types of this crate.

/// Implemented where a marker trait is, and reached from nowhere else.
pub trait OwnMarker {}
