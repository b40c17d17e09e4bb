//! A sample's files: what each is of it.

use std::path::{Path, PathBuf};

/// What a file is of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    Image,
    Diffuse,
    Normals,
    NormalsValid,
    Albedo,
    Shading,
    Highlight,
    Mask,
    Light,
    /// The largest values that `shading` and `highlight` stand for.
    Whites,
}

/// A file of a sample.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Part {
    pub(super) role: Role,
    pub(super) path: PathBuf,
    /// Whether the sample is damaged without it.
    pub(super) required: bool,
}

/// A sample's name and files.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entry {
    pub(super) name: String,
    pub(super) parts: Vec<Part>,
}

/// The last part of a path.
pub(super) fn name_of(path: &Path) -> String {
    path.file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}
