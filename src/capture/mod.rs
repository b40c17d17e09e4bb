//! A turn as a session on disk.

pub mod trace;
