//! What a person says about a take, in its manifest.

use std::fs;
use std::path::Path;

use serde_json::Value;

use super::{MANIFEST_FILE, Manifest, SessionError};
use crate::durable;

/// Writes note and rating (1 to 5) of a session that has ended to its manifest; `None` removes them. All
/// other fields, also those that this version does not know, stay as they are.
///
/// # Errors
/// [`SessionError::Unusable`] if the manifest, or the rating, is not usable, or [`SessionError::Io`].
pub fn annotate(folder: &Path, note: Option<&str>, rating: Option<u8>) -> Result<(), SessionError> {
    let path = folder.join(MANIFEST_FILE);
    let bytes = fs::read(&path).map_err(SessionError::io(&path, "read"))?;
    let fault = |fault: String| SessionError::manifest(&path, &fault);
    let bytes = with_remarks(&bytes, note, rating).map_err(fault)?;
    durable::write_whole(&path, &bytes).map_err(SessionError::io(&path, "written"))
}

fn with_remarks(bytes: &[u8], note: Option<&str>, rating: Option<u8>) -> Result<Vec<u8>, String> {
    let fault = |error: serde_json::Error| error.to_string();
    let mut manifest: serde_json::Map<String, Value> =
        serde_json::from_slice(bytes).map_err(fault)?;
    for (field, value) in [
        ("note", note.map(Value::from)),
        ("rating", rating.map(Value::from)),
    ] {
        match value {
            Some(value) => manifest.insert(field.to_owned(), value),
            None => manifest.remove(field),
        };
    }
    let mut bytes = serde_json::to_vec_pretty(&manifest).map_err(fault)?;
    bytes.push(b'\n');
    Manifest::from_json(&bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::super::writer::writer;
    use super::*;

    #[test]
    fn remarks_are_written_and_removed_and_unknown_fields_stay() {
        let root = tempfile::tempdir().unwrap();
        let writer = writer(root.path());
        let folder = writer.folder().to_owned();
        writer.abort("a test").unwrap();
        let path = folder.join(MANIFEST_FILE);
        let text = fs::read_to_string(&path).unwrap();
        let known = text.replacen('{', "{\"later\": [1],", 1);
        fs::write(&path, known).unwrap();
        annotate(&folder, Some("a fly on it"), Some(2)).unwrap();
        let read = |path| Manifest::from_json(&fs::read(path).unwrap()).unwrap();
        let manifest = read(&path);
        assert_eq!(manifest.note.as_deref(), Some("a fly on it"));
        assert_eq!(manifest.rating, Some(2));
        assert!(fs::read_to_string(&path).unwrap().contains("\"later\""));
        assert!(annotate(&folder, None, Some(9)).is_err());
        assert_eq!(read(&path), manifest);
        annotate(&folder, None, None).unwrap();
        assert_eq!((read(&path).note, read(&path).rating), (None, None));
    }
}
