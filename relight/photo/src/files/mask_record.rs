//! What `relit-mask` wrote beside a mask: whether it was made of the photograph as it is displayed.

use std::fs;
use std::path::Path;

use relit_data::text::unmarked;
use serde::Deserialize;

use crate::decompose::DecomposeError;

/// The schema of the records that are looked at.
const SCHEMA: &str = "relit.mask/1";

/// The part of a mask's record that counts here.
#[derive(Deserialize)]
struct MaskRecord {
    schema: String,
    source: Source,
}

#[derive(Deserialize)]
struct Source {
    /// File name of the photograph.
    video: String,
    /// How it was turned for display before.
    #[serde(default)]
    exif_orientation: Option<u8>,
}

/// Refuses a mask that was made of this photograph as it is stored, where Exif's `orientation` turns it for display. Of
/// masks without a record nothing is known.
pub(super) fn check_turned(
    mask: &Path,
    photo: &Path,
    orientation: Option<u8>,
) -> Result<(), DecomposeError> {
    let bytes = fs::read(mask.with_extension("json")).unwrap_or_default();
    let Ok(record) = serde_json::from_slice::<MaskRecord>(unmarked(&bytes)) else {
        return Ok(());
    };
    let is_of_photo = photo
        .file_name()
        .is_some_and(|name| name.to_string_lossy() == record.source.video);
    let Source {
        exif_orientation: made,
        ..
    } = record.source;
    if record.schema == SCHEMA && is_of_photo && made != orientation {
        return Err(DecomposeError::Photo(format!(
            "{} was made of {} before it was turned as its Exif orientation says: make it again with this version's relit-mask",
            mask.display(),
            photo.display()
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_of_the_photograph_as_it_is_stored_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let mask = folder.path().join("mask.png");
        let check = |record: &str, photo: &str, orientation| {
            fs::write(mask.with_extension("json"), record).unwrap();
            check_turned(&mask, Path::new(photo), orientation)
        };
        let old = r#"{"schema": "relit.mask/1", "source": {"video": "a.jpg", "frame": 0}}"#;
        let error = check(old, "photos/a.jpg", Some(3)).unwrap_err().to_string();
        assert!(error.contains("relit-mask"), "{error}");
        assert!(check(old, "photos/a.jpg", None).is_ok());
        assert!(check(old, "photos/b.jpg", Some(3)).is_ok());
        let new =
            r#"{"schema": "relit.mask/1", "source": {"video": "a.jpg", "exif_orientation": 3}}"#;
        assert!(check(new, "a.jpg", Some(3)).is_ok());
        assert!(check(new, "a.jpg", None).is_err());
        assert!(check("painted by hand", "a.jpg", Some(3)).is_ok());
        let without = folder.path().join("other.png");
        assert!(check_turned(&without, Path::new("a.jpg"), Some(3)).is_ok());
    }
}
