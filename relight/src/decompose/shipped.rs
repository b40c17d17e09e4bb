//! The weights that come with the program.

/// Where they stand in the repository.
pub(super) const NAME: &str = "relight/weights/decompose.safetensors";

/// The bytes of that file.
pub(super) const WEIGHTS: &[u8] = include_bytes!("../../weights/decompose.safetensors");
