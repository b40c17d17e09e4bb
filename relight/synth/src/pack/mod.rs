//! Packed libraries: many objects and panoramas in one file, with the author and licence of each.
//!
//! | file | concern |
//! | --- | --- |
//! | `build` | a library from folders and archives; what is left out |
//! | `candidates` | which files there are, and where each comes from |
//! | `furniture` | archives of Sweet Home 3D and their catalogues |
//! | `origin` | `origin.toml`: who made the files of a folder |
//! | `prepare` | one object, repaired, judged and made small |
//! | `orient` | triangles that face one way |
//! | `mesh` | a mesh as bytes |
//! | `panorama` | a panorama, made small, as bytes |
//! | `file` | the file: a zip archive with a catalogue |
//! | `table` | the table of contents, as `.csv` |

mod build;
mod candidates;
mod file;
mod furniture;
mod mesh;
mod orient;
mod origin;
mod panorama;
mod prepare;
mod table;
#[cfg(test)]
mod tests;

use std::path::Path;

use relit_data::shard::Digest;
use serde::{Deserialize, Serialize};

pub use build::{LibrarySources, LibrarySummary, build_library};
pub(crate) use file::PackedLibrary;

/// What the file of a packed library ends in.
pub const LIBRARY_EXTENSION: &str = "relib";

/// One of so many objects and panoramas is for validation only.
const VALIDATION: u64 = 10;

/// An object or a panorama of a packed library: what it is, and whose.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LibraryEntry {
    /// Its name in the library; the same in each build.
    pub name: String,
    /// Its description.
    pub title: String,
    /// The category of its catalogue; empty without one.
    pub category: String,
    /// Who made it.
    pub author: String,
    /// As in SPDX where it is a known one, else in words.
    pub licence: String,
    /// The collection that it was taken from.
    pub origin: String,
    /// Whether it is for validation only.
    pub is_for_validation: bool,
}

/// Stands for an unknown author or licence.
const UNKNOWN: &str = "unknown";

/// Whether what has this name is for validation only: one of ten, by a hash of the name alone, so that it stays so in
/// each library.
fn is_for_validation(name: &str) -> bool {
    let digest = Digest::hash(name.as_bytes()).to_string();
    let number = digest.get(..8).map(|text| u64::from_str_radix(text, 16));
    matches!(number, Some(Ok(number)) if number % VALIDATION == 0)
}

/// Whether a path is that of a packed library.
pub fn is_packed(path: &Path) -> bool {
    relit_data::file_names::has_extension(path, &[LIBRARY_EXTENSION]) && path.is_file()
}
