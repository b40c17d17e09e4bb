//! `origin.toml`: the author and licence of the files of a folder.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::SynthError;

/// The file's name.
pub(super) const ORIGIN: &str = "origin.toml";

/// The origin that a file states for all files in its folder and below, or for one of them.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Origin {
    pub(super) title: Option<String>,
    pub(super) category: Option<String>,
    pub(super) author: Option<String>,
    pub(super) licence: Option<String>,
    pub(super) origin: Option<String>,
    /// Whether it is for validation only, in place of the hash of its name.
    pub(super) validation: Option<bool>,
    /// Why it is not to be learned from.
    pub(super) leave_out: Option<String>,
    /// By the path from the folder, with `/`.
    files: BTreeMap<String, Self>,
}

/// The files that say so, each read once.
#[derive(Debug, Default)]
pub(super) struct Origins {
    read: BTreeMap<PathBuf, Option<Origin>>,
}

impl Origins {
    /// The origin of a file below `root`: the nearest [`ORIGIN`] counts.
    ///
    /// # Errors
    /// If that file is damaged.
    pub(super) fn of(&mut self, root: &Path, path: &Path) -> Result<Origin, SynthError> {
        for folder in path.ancestors().skip(1) {
            if let Some(origin) = self.folder(folder)? {
                let name = path.strip_prefix(folder).unwrap_or(path);
                return Ok(origin.of_file(&slashed(name)));
            }
            if folder == root {
                break;
            }
        }
        Ok(Origin::default())
    }

    fn folder(&mut self, folder: &Path) -> Result<Option<&Origin>, SynthError> {
        if !self.read.contains_key(folder) {
            let path = folder.join(ORIGIN);
            let origin = if path.is_file() {
                let text = fs::read_to_string(&path).map_err(SynthError::read(&path))?;
                let origin = toml::from_str(&text).map_err(|fault| {
                    SynthError::unusable(&path, format!("cannot be used: {fault}"))
                });
                Some(origin?)
            } else {
                None
            };
            self.read.insert(folder.to_owned(), origin);
        }
        Ok(self.read.get(folder).and_then(Option::as_ref))
    }
}

impl Origin {
    fn of_file(&self, name: &str) -> Self {
        let own = self.files.get(name).cloned().unwrap_or_default();
        let all = |own: Option<String>, of_all: &Option<String>| own.or_else(|| of_all.clone());
        Self {
            title: own.title,
            category: all(own.category, &self.category),
            author: all(own.author, &self.author),
            licence: all(own.licence, &self.licence),
            origin: all(own.origin, &self.origin),
            validation: own.validation.or(self.validation),
            leave_out: all(own.leave_out, &self.leave_out),
            files: BTreeMap::new(),
        }
    }
}

/// A path's parts with `/` between them.
pub(super) fn slashed(path: &Path) -> String {
    let parts: Vec<_> = path.iter().map(|part| part.to_string_lossy()).collect();
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_file_counts_and_what_it_says_of_one_file_before_all() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        fs::create_dir_all(root.join("a/b")).unwrap();
        let text = "author = \"Ann\"\nlicence = \"CC0-1.0\"\n[files.\"b/c.obj\"]\nauthor = \"Bob\"\nleave_out = \"research only\"\n";
        fs::write(root.join("a").join(ORIGIN), text).unwrap();
        let mut origins = Origins::default();
        let one = origins.of(root, &root.join("a/b/c.obj")).unwrap();
        assert_eq!(one.author.as_deref(), Some("Bob"));
        assert_eq!(one.licence.as_deref(), Some("CC0-1.0"));
        assert!(one.leave_out.is_some());
        let other = origins.of(root, &root.join("a/b/d.obj")).unwrap();
        assert_eq!(other.author.as_deref(), Some("Ann"));
        assert_eq!(
            origins.of(root, &root.join("e.obj")).unwrap(),
            Origin::default()
        );
        fs::write(root.join(ORIGIN), "autor = 1").unwrap();
        let error = Origins::default()
            .of(root, &root.join("e.obj"))
            .unwrap_err();
        assert!(error.to_string().contains("origin.toml"), "{error}");
    }
}
