//! What a capture leaves on disk.
