//! Where what was found about a mask is written: the page for a person, and the record for programs.

use std::path::{Path, PathBuf};

use relit_data::session::{MANIFEST_FILE, Recording};
use serde::Serialize;

use super::super::{MaskFiles, MaskingError};
use super::MaskReport;

/// The schema of the record.
const CHECK_SCHEMA: &str = "relit.mask-check/1";

/// What the record holds.
#[derive(Serialize)]
struct CheckRecord<'a> {
    schema: &'static str,
    recording: &'a str,
    /// BLAKE3 of the mask's file: the check of another mask says nothing about this one.
    mask_blake3: String,
    #[serde(flatten)]
    report: &'a MaskReport,
}

/// The page and the record: `NAME-check.html` and `NAME-check.json` beside the mask. Where the mask is another session's, or
/// lies apart from the session that it is held against, the names have that session's too: the files of the mask's own
/// session stay.
pub(super) fn check_files(files: &MaskFiles, recording: &Recording) -> [PathBuf; 2] {
    let mut stem = files.mask.file_stem().unwrap_or_default().to_owned();
    if !is_own(&files.mask, recording) {
        stem.push("-on-");
        stem.push(&recording.id);
    }
    ["-check.html", "-check.json"].map(|ending| {
        let mut name = stem.clone();
        name.push(ending);
        files.mask.with_file_name(name)
    })
}

/// Whether the mask is that of the recording, as far as its place says.
fn is_own(mask: &Path, recording: &Recording) -> bool {
    let beside = match mask.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    match &recording.folder {
        Some(folder) => same(beside, folder),
        None => !beside.join(MANIFEST_FILE).is_file(),
    }
}

fn same(one: &Path, other: &Path) -> bool {
    match (one.canonicalize(), other.canonicalize()) {
        (Ok(one), Ok(other)) => one == other,
        _ => one == other,
    }
}

/// The record of a check, as it is written; `png` is the mask's file.
pub(super) fn record(
    recording: &str,
    report: &MaskReport,
    png: &[u8],
    path: &Path,
) -> Result<Vec<u8>, MaskingError> {
    let record = CheckRecord {
        schema: CHECK_SCHEMA,
        recording,
        mask_blake3: blake3::hash(png).to_hex().to_string(),
        report,
    };
    let json = serde_json::to_vec_pretty(&record);
    let mut bytes = json.map_err(|error| MaskingError::io(path, "written")(error.into()))?;
    bytes.push(b'\n');
    Ok(bytes)
}
