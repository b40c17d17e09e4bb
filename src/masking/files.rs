//! The files of a mask: their names, and which of those that exist may be replaced.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use relit_data::durable;
use relit_mask::MaskRecord;

use super::MaskingError;

/// The paths of a mask's three files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MaskFiles {
    /// The mask.
    pub mask: PathBuf,
    /// Its record.
    pub record: PathBuf,
    /// The preview.
    pub preview: PathBuf,
    /// The share of the object in each pixel; written only if the settings ask for it.
    pub alpha: PathBuf,
}

impl MaskFiles {
    /// The files of the mask `mask`, whose name must end in `.png`.
    ///
    /// # Errors
    /// [`MaskingError::OutputName`].
    pub fn of(mask: &Path) -> Result<Self, MaskingError> {
        let is_png = mask
            .extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("png"));
        match mask.file_stem() {
            Some(stem) if is_png => {
                let mut preview = stem.to_owned();
                preview.push("-preview.png");
                let mut alpha = stem.to_owned();
                alpha.push("-alpha.png");
                if stem == "mask" {
                    alpha = "alpha.png".into();
                }
                Ok(Self {
                    mask: mask.to_owned(),
                    record: mask.with_extension("json"),
                    preview: mask.with_file_name(preview),
                    alpha: mask.with_file_name(alpha),
                })
            }
            _ => Err(MaskingError::OutputName(mask.to_owned())),
        }
    }
}

/// Checks that existing files may be replaced.
pub(super) fn check_replaceable(files: &MaskFiles, force: bool) -> Result<(), MaskingError> {
    let record = match read_if_exists(&files.record)? {
        None => None,
        Some(bytes) => {
            let record =
                MaskRecord::from_json(&bytes).map_err(|fault| MaskingError::ForeignFile {
                    path: files.record.clone(),
                    why: fault.to_string(),
                })?;
            Some(record)
        }
    };
    if force {
        return Ok(());
    }
    let Some(mask) = read_if_exists(&files.mask)? else {
        return Ok(());
    };
    let found = blake3::hash(&mask).to_hex();
    match record {
        Some(record) if record.result.mask_blake3 == found.as_str() => Ok(()),
        _ => Err(MaskingError::Handmade(files.mask.clone())),
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn record_and_preview_are_named_after_the_mask() {
        let files = MaskFiles::of(Path::new("a/mug.v2.PNG")).unwrap();
        assert_eq!(files.record, Path::new("a/mug.v2.json"));
        assert_eq!(files.preview, Path::new("a/mug.v2-preview.png"));
        assert_eq!(files.alpha, Path::new("a/mug.v2-alpha.png"));
        let files = MaskFiles::of(Path::new("a/mask.png")).unwrap();
        assert_eq!(files.alpha, Path::new("a/alpha.png"));
    }

    #[test]
    fn the_name_of_a_mask_must_end_in_png() {
        for name in ["mask", "mask.jpg", "session.json", ".png", ""] {
            let files = MaskFiles::of(Path::new(name));
            assert!(matches!(files, Err(MaskingError::OutputName(_))), "{name}");
        }
    }

    #[test]
    fn a_file_that_is_not_a_record_is_never_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let files = MaskFiles::of(&folder.path().join("session.png")).unwrap();
        fs::write(&files.record, r#"{"schema": "relit.session/1"}"#).unwrap();
        let result = check_replaceable(&files, true);
        assert!(matches!(result, Err(MaskingError::ForeignFile { .. })));
    }

    #[test]
    fn a_mask_without_record_is_replaced_only_with_force() {
        let folder = tempfile::tempdir().unwrap();
        let files = MaskFiles::of(&folder.path().join("mask.png")).unwrap();
        assert!(check_replaceable(&files, false).is_ok());
        fs::write(&files.mask, "painted").unwrap();
        assert!(matches!(
            check_replaceable(&files, false),
            Err(MaskingError::Handmade(_))
        ));
        assert!(check_replaceable(&files, true).is_ok());
    }
}
