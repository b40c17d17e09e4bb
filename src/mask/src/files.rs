//! The files of a mask: their names, and which of those that exist may be replaced.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use relit_data::durable::{self, CreatedFolder, SealedPartial};

use super::{MaskRecord, MaskingError};

/// The paths of a mask's three files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MaskFiles {
    /// The mask.
    pub mask: PathBuf,
    /// Its record.
    pub record: PathBuf,
    /// The preview.
    pub preview: PathBuf,
    /// The record of the mask before it, kept where a person painted for that one.
    pub previous: PathBuf,
}

impl MaskFiles {
    /// The files of the mask `mask`, whose name must end in `.png`.
    ///
    /// # Errors
    /// [`MaskingError::OutputName`].
    pub fn from_mask_path(mask: &Path) -> Result<Self, MaskingError> {
        let is_png = mask
            .extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("png"));
        match mask.file_stem() {
            Some(stem) if is_png => {
                let named = |ending: &str| {
                    let mut name = stem.to_owned();
                    name.push(ending);
                    mask.with_file_name(name)
                };
                Ok(Self {
                    mask: mask.to_owned(),
                    record: mask.with_extension("json"),
                    preview: named("-preview.png"),
                    previous: named("-previous.json"),
                })
            }
            _ => Err(MaskingError::OutputName(mask.to_owned())),
        }
    }
}

/// Checks that existing files may be replaced. `inputs` may not, even by force.
pub(super) fn check_replaceable<'a>(
    files: &MaskFiles,
    inputs: impl IntoIterator<Item = &'a Path>,
    force: bool,
) -> Result<(), MaskingError> {
    let written =
        [&files.mask, &files.preview].map(|path| Some((path, fs::canonicalize(path).ok()?)));
    let there: Vec<_> = written.into_iter().flatten().collect();
    if !there.is_empty() {
        for input in inputs
            .into_iter()
            .filter_map(|path| fs::canonicalize(path).ok())
        {
            if let Some((path, _)) = there.iter().find(|(_, whole)| *whole == input) {
                return Err(MaskingError::IsInput((*path).clone()));
            }
        }
    }
    let record = read_record(&files.record)?;
    // It may be written, too, and another program's file of that name is never overwritten.
    read_record(&files.previous)?;
    if force {
        return Ok(());
    }
    let Some(mask) = read_if_exists(&files.mask)? else {
        return match record {
            None if files.preview.exists() => Err(MaskingError::ForeignFile {
                path: files.preview.clone(),
                why: "no record says that it is a mask's preview".to_owned(),
            }),
            _ => Ok(()),
        };
    };
    let found = blake3::hash(&mask).to_hex();
    match record {
        Some(record) if record.result.mask_blake3 == found.as_str() => Ok(()),
        _ => Err(MaskingError::Handmade(files.mask.clone())),
    }
}

/// Makes the mask's folder, before anybody works on a mask that cannot be kept. While nothing is in it, it goes with what is
/// returned.
pub(super) fn make_folder(files: &MaskFiles) -> Result<CreatedFolder, MaskingError> {
    let folder = files.mask.parent().unwrap_or(Path::new(""));
    CreatedFolder::make(folder).map_err(MaskingError::io(folder, "made"))
}

/// The record in a file, if there is such a file.
pub(super) fn read_record(path: &Path) -> Result<Option<MaskRecord>, MaskingError> {
    let Some(bytes) = read_if_exists(path)? else {
        return Ok(None);
    };
    let record = MaskRecord::from_json(&bytes).map_err(|why| MaskingError::ForeignFile {
        path: path.to_owned(),
        why: format!("it is not a mask's record ({why})"),
    })?;
    Ok(Some(record))
}

pub(super) fn read_if_exists(path: &Path) -> Result<Option<Vec<u8>>, MaskingError> {
    match fs::read(path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(MaskingError::io(path, "read")(error)),
    }
}

pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<(), MaskingError> {
    durable::write_whole(path, bytes).map_err(MaskingError::io(path, "written"))
}

/// Writes files in this order, none before all of them are on the disk.
pub(super) fn write_all(files: &[(&Path, &[u8])]) -> Result<(), MaskingError> {
    let mut sealed = Vec::with_capacity(files.len());
    for (path, bytes) in files {
        sealed.push(SealedPartial::write(path, bytes).map_err(MaskingError::io(path, "written"))?);
    }
    for (file, (path, _)) in sealed.into_iter().zip(files) {
        file.publish().map_err(MaskingError::io(path, "written"))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn record_and_preview_are_named_after_the_mask() {
        let files = MaskFiles::from_mask_path(Path::new("a/mug.v2.PNG")).unwrap();
        assert_eq!(files.record, Path::new("a/mug.v2.json"));
        assert_eq!(files.preview, Path::new("a/mug.v2-preview.png"));
        assert_eq!(files.previous, Path::new("a/mug.v2-previous.json"));
    }

    #[test]
    fn the_name_of_a_mask_must_end_in_png() {
        for name in ["mask", "mask.jpg", "session.json", ".png", ""] {
            let files = MaskFiles::from_mask_path(Path::new(name));
            assert!(matches!(files, Err(MaskingError::OutputName(_))), "{name}");
        }
    }

    #[test]
    fn a_file_that_is_not_a_record_is_never_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let files = MaskFiles::from_mask_path(&folder.path().join("session.png")).unwrap();
        fs::write(&files.record, r#"{"schema": "relit.session/1"}"#).unwrap();
        let result = check_replaceable(&files, [], true);
        assert!(matches!(result, Err(MaskingError::ForeignFile { .. })));
        fs::rename(&files.record, &files.previous).unwrap();
        let result = check_replaceable(&files, [], true);
        assert!(matches!(
            result,
            Err(MaskingError::ForeignFile { path, .. }) if path == files.previous
        ));
    }

    #[test]
    fn the_folder_of_a_mask_is_made() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("masks").join("of").join("mug.png");
        let made = make_folder(&MaskFiles::from_mask_path(&path).unwrap()).unwrap();
        assert!(path.parent().unwrap().is_dir());
        drop(made);
        assert!(!folder.path().join("masks").exists());
    }

    #[test]
    fn a_file_in_the_place_of_a_masks_folder_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mug.png");
        fs::write(&path, "painted").unwrap();
        let below = MaskFiles::from_mask_path(&path.join("mug.png")).unwrap();
        let error = make_folder(&below).unwrap_err();
        assert!(matches!(error, MaskingError::Io { path: place, .. } if place == path));
    }

    #[test]
    fn a_mask_without_record_is_replaced_only_with_force() {
        let folder = tempfile::tempdir().unwrap();
        let files = MaskFiles::from_mask_path(&folder.path().join("mask.png")).unwrap();
        assert!(check_replaceable(&files, [], false).is_ok());
        fs::write(&files.mask, "painted").unwrap();
        assert!(matches!(
            check_replaceable(&files, [], false),
            Err(MaskingError::Handmade(_))
        ));
        assert!(check_replaceable(&files, [], true).is_ok());
    }
}
