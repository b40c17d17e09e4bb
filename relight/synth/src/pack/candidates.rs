//! The objects and panoramas to choose from, and their origins.

use std::path::{Path, PathBuf};

use glam::Mat3;

use super::furniture::{Furniture, Model};
use super::origin::{Origins, slashed};
use super::{LibraryEntry, UNKNOWN, is_for_validation};
use crate::SynthError;
use crate::library::{MESHES, PANORAMAS, files_below};
use relit_data::file_names::has_extension;

/// What archives of furniture end in.
const FURNITURE: &str = "sh3f";

/// A file of an object or a panorama.
#[derive(Debug)]
pub(super) struct Candidate {
    pub(super) path: PathBuf,
    pub(super) entry: LibraryEntry,
    /// Whether its catalogue places it in a wall.
    pub(super) is_door_or_window: bool,
    /// Why it is excluded from training, if its folder says so.
    pub(super) leave_out: Option<String>,
    pub(super) rotation: Mat3,
}

/// Objects, and the archives from which they were unpacked: the files exist as long as these.
#[derive(Default)]
pub(super) struct Candidates {
    pub(super) all: Vec<Candidate>,
    archives: Vec<Furniture>,
}

impl Candidates {
    /// All objects in folders, in those within them and in archives there; archives may also be named themselves.
    ///
    /// # Errors
    /// If none is found, or a folder or an archive cannot be read.
    pub(super) fn objects(folders: &[PathBuf]) -> Result<Self, SynthError> {
        let mut candidates = Self::default();
        let mut origins = Origins::default();
        for folder in folders {
            let before = candidates.all.len();
            for path in files_of(folder)? {
                if has_extension(&path, &[FURNITURE]) {
                    let archive = Furniture::open(&path)?;
                    candidates
                        .all
                        .extend(archive.models().into_iter().map(Candidate::from_model));
                    candidates.archives.push(archive);
                } else if MESHES.includes(&path) {
                    candidates
                        .all
                        .push(Candidate::from_file(folder, path, &mut origins)?);
                }
            }
            if candidates.all.len() == before {
                let fault = "holds no meshes: give a folder of files that end in .obj, .gltf, .glb or .sh3f";
                return Err(SynthError::unusable(folder, fault));
            }
        }
        Ok(candidates)
    }

    /// All panoramas in folders and in those within them.
    ///
    /// # Errors
    /// If none is found, or a folder cannot be read.
    pub(super) fn panoramas(folders: &[PathBuf]) -> Result<Self, SynthError> {
        let mut candidates = Self::default();
        let mut origins = Origins::default();
        for folder in folders {
            let before = candidates.all.len();
            for path in files_of(folder)? {
                if PANORAMAS.includes(&path) {
                    candidates
                        .all
                        .push(Candidate::from_file(folder, path, &mut origins)?);
                }
            }
            if candidates.all.len() == before {
                return Err(PANORAMAS.missing(folder));
            }
        }
        Ok(candidates)
    }
}

/// The files below a folder, or the file itself.
fn files_of(path: &Path) -> Result<Vec<PathBuf>, SynthError> {
    if path.is_file() {
        Ok(vec![path.to_owned()])
    } else {
        files_below(path)
    }
}

impl Candidate {
    fn from_model(model: Model) -> Self {
        let entry = LibraryEntry {
            is_for_validation: is_for_validation(&model.name),
            name: model.name,
            title: model.title,
            category: model.category,
            author: model.author,
            licence: model.licence,
            origin: model.origin,
        };
        Self {
            path: model.path,
            entry,
            is_door_or_window: model.is_door_or_window,
            leave_out: None,
            rotation: model.rotation,
        }
    }

    fn from_file(folder: &Path, path: PathBuf, origins: &mut Origins) -> Result<Self, SynthError> {
        let said = origins.of(folder, &path)?;
        let collection = folder.file_name().unwrap_or_default().to_string_lossy();
        let within = slashed(path.strip_prefix(folder).unwrap_or(&path));
        let name = format!("{collection}/{within}");
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let known = |text: Option<String>| text.unwrap_or_else(|| UNKNOWN.to_owned());
        let by_name = is_for_validation(&name);
        let entry = LibraryEntry {
            is_for_validation: said.validation.unwrap_or(by_name),
            name,
            title: said.title.unwrap_or_else(|| stem.replace(['_', '-'], " ")),
            category: said.category.unwrap_or_default(),
            author: known(said.author),
            licence: known(said.licence),
            origin: said.origin.unwrap_or_else(|| collection.into_owned()),
        };
        Ok(Self {
            path,
            entry,
            is_door_or_window: false,
            leave_out: said.leave_out,
            rotation: Mat3::IDENTITY,
        })
    }
}
