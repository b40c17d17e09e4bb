//! Inputs and data sets in object stores: `s3://`, `gs://`, `az://` and `file://` URLs.
//!
//! Decoding needs files, so a recording is brought to a folder on the local disk, extracted there, and its
//! files are uploaded. A description is uploaded after the files that it lists. What is on the local disk of one
//! recording is removed before the next.
//!
//! | module | purpose |
//! | --- | --- |
//! | `url` | URLs told from paths, and what of them may be printed |
//! | `bucket` | objects by their names: list, download, upload |
//! | `staging` | the folder on the local disk, and what goes to and fro |
//!
//! The last two are built with the feature `object-store` only; without it, URLs are refused. This module knows nothing of
//! frames.

#[cfg(feature = "object-store")]
mod bucket;
#[cfg(feature = "object-store")]
mod staging;
mod url;

use std::fs;
use std::path::Path;
#[cfg(not(feature = "object-store"))]
use std::path::PathBuf;

use relit_data::shard::{self, Dataset, MergedDataset};

use super::ExtractError;
#[cfg(not(feature = "object-store"))]
use super::{ExtractOptions, ExtractSummary, Observer};

#[cfg(feature = "object-store")]
pub(super) use staging::extract;
pub use url::is_url;

/// As [`extract`](super::extract), where some of the inputs or `out` are URLs.
#[cfg(not(feature = "object-store"))]
pub(super) fn extract(
    inputs: &[PathBuf],
    out: &Path,
    _: &ExtractOptions,
    _: &dyn Observer,
) -> Result<ExtractSummary, ExtractError> {
    let mut all = inputs.iter().map(PathBuf::as_path).chain([out]);
    Err(not_built(all.find(|path| is_url(path)).unwrap_or(out)))
}

#[cfg(not(feature = "object-store"))]
fn not_built(path: &Path) -> ExtractError {
    ExtractError::Refused(format!(
        "{} is a URL, and this program was built without object stores: build it with `--features object-store`, or give a folder",
        url::without_credentials(&path.to_string_lossy())
    ))
}

/// The description of the data set in `out`, a folder or a URL: see [`read_partial`](shard::read_partial).
///
/// # Errors
/// As there; [`ExtractError::Refused`] if an object store cannot be used.
pub fn described(out: &Path) -> Result<(Dataset, Option<String>), ExtractError> {
    match is_url(out) {
        false => Ok(shard::read_partial(out)?),
        #[cfg(feature = "object-store")]
        true => staging::described(out),
        #[cfg(not(feature = "object-store"))]
        true => Err(not_built(out)),
    }
}

/// Joins the pieces of several tasks in `out`, a folder or a URL: see [`merge`](shard::merge()).
///
/// # Errors
/// As [`merge`](shard::merge()); [`ExtractError::Refused`] if an object store cannot be used.
pub fn merge(out: &Path) -> Result<MergedDataset, ExtractError> {
    match is_url(out) {
        false => {
            let length = |file: &str| fs::metadata(out.join(file)).map(|found| found.len());
            Ok(shard::merge(out, &length)?)
        }
        #[cfg(feature = "object-store")]
        true => staging::merge(out),
        #[cfg(not(feature = "object-store"))]
        true => Err(not_built(out)),
    }
}
