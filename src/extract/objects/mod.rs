//! Inputs and data sets in object stores: `s3://`, `gs://`, `az://` and `file://` URLs.
//!
//! Decoding needs files, so a recording is brought to a folder on the local disk, extracted there, and its
//! files are uploaded. A description is uploaded after the files that it lists. What is on the local disk of one
//! recording is removed before the next.
//!
//! | module | purpose |
//! | --- | --- |
//! | `bucket` | objects by their names: list, download, upload |
//! | `staging` | the folder on the local disk, and what goes to and fro |
//!
//! Both are built with the feature `object-store` only; without it, URLs are refused. This module knows nothing of
//! frames.

#[cfg(feature = "object-store")]
mod bucket;
mod error;
#[cfg(feature = "object-store")]
mod staging;

use std::path::{Path, PathBuf};

use relit_data::shard::{Merged, Overview};

use super::{ExtractError, ExtractOptions, Observer, Tally};

pub use error::ObjectError;

/// Whether a path is a URL, such as `s3://bucket/sessions`.
#[must_use]
pub fn is_url(path: &Path) -> bool {
    let Some((scheme, _)) = path.to_str().and_then(|text| text.split_once("://")) else {
        return false;
    };
    let valid = |c: char| c.is_ascii_alphanumeric() || "+-.".contains(c);
    scheme.starts_with(|c: char| c.is_ascii_alphabetic()) && scheme.chars().all(valid)
}

/// That a URL holds no credentials, which would be printed and recorded.
///
/// # Errors
/// [`ObjectError::Credentials`].
pub fn check(url: &Path) -> Result<(), ObjectError> {
    let text = url.to_string_lossy();
    let rest = text.split_once("://").map_or("", |(_, rest)| rest);
    let host = rest.split('/').next().unwrap_or_default();
    match host.contains('@') || rest.contains('?') {
        true => Err(ObjectError::Credentials(without_credentials(&text))),
        false => Ok(()),
    }
}

/// A URL as it may be printed.
fn without_credentials(url: &str) -> String {
    let url = url.split(['?', '#']).next().unwrap_or_default();
    let url = url.trim_end_matches('/');
    let Some((scheme, rest)) = url.split_once("://") else {
        return url.to_owned();
    };
    let (host, path) = rest.split_once('/').unwrap_or((rest, ""));
    let host = host.rsplit('@').next().unwrap_or_default();
    match path {
        "" => format!("{scheme}://{host}"),
        path => format!("{scheme}://{host}/{path}"),
    }
}

/// As [`extract`](super::extract), where some of the inputs or `out` are URLs.
#[cfg(feature = "object-store")]
pub(super) fn extract(
    inputs: &[PathBuf],
    out: &Path,
    options: &ExtractOptions,
    observer: &dyn Observer,
) -> Result<Tally, ExtractError> {
    staging::extract(inputs, out, options, observer)
}

#[cfg(not(feature = "object-store"))]
pub(super) fn extract(
    inputs: &[PathBuf],
    out: &Path,
    _: &ExtractOptions,
    _: &dyn Observer,
) -> Result<Tally, ExtractError> {
    let mut all = inputs.iter().map(PathBuf::as_path).chain([out]);
    let url = all.find(|path| is_url(path)).unwrap_or(out);
    Err(not_built(url).into())
}

#[cfg(not(feature = "object-store"))]
fn not_built(url: &Path) -> ObjectError {
    ObjectError::NotBuilt(without_credentials(&url.to_string_lossy()))
}

/// The data set in `out` at a glance, a folder or a URL, of which descriptions and tables are downloaded.
///
/// # Errors
/// As [`Overview::read`]; [`ObjectError`].
pub fn overview(out: &Path) -> Result<Overview, ExtractError> {
    match is_url(out) {
        false => Ok(Overview::read(out)?),
        #[cfg(feature = "object-store")]
        true => staging::overview(out),
        #[cfg(not(feature = "object-store"))]
        true => Err(not_built(out).into()),
    }
}

/// Joins the pieces of several tasks in `out`, a folder or a URL: see [`merge`](relit_data::shard::merge()).
///
/// # Errors
/// As [`merge`](relit_data::shard::merge()); [`ObjectError`].
pub fn merge(out: &Path) -> Result<Merged, ExtractError> {
    match is_url(out) {
        false => Ok(relit_data::shard::merge(out)?),
        #[cfg(feature = "object-store")]
        true => staging::merge(out),
        #[cfg(not(feature = "object-store"))]
        true => Err(not_built(out).into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn credentials_in_a_url_are_refused_and_not_printed() {
        for url in ["s3://key:secret@bucket/a", "s3://bucket/a?sig=secret"] {
            let text = check(Path::new(url)).unwrap_err().to_string();
            assert!(
                text.contains("s3://bucket/a") && !text.contains("secret"),
                "{text}"
            );
        }
        check(Path::new("s3://bucket/a@b")).unwrap();
    }

    #[test]
    fn a_url_is_told_from_a_path() {
        for url in ["s3://bucket/a", "az://c", "file:///tmp"] {
            assert!(is_url(Path::new(url)), "{url}");
        }
        for path in ["a/b", "/s3:/x", "C:\\a", "://a", "1a://b"] {
            assert!(!is_url(Path::new(path)), "{path}");
        }
    }
}
