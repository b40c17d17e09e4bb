//! Where `relight turn` writes, looked at before the work.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf, absolute};

use relight_core::captured_object::CapturedObject;
use relight_core::files::MovieWriter;
use relight_turn::{TurnFiles, TurnLabels};

use super::arguments::Arguments;

/// What the object is called in the folder of the results.
const ASSET: &str = "object.relit";

/// Where the object is written as a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AssetPlace<'a> {
    /// Nowhere.
    None,
    /// Among the other results.
    Inside,
    /// Elsewhere.
    Beside(&'a Path),
}

/// Refuses places that cannot be written, or of which one would be lost in another, and returns that of the asset.
///
/// # Errors
/// With one sentence for the first of them.
pub(super) fn check_places(arguments: &Arguments) -> Result<AssetPlace<'_>, Box<dyn Error>> {
    let output = place(&arguments.output);
    TurnFiles::check(&arguments.output)?;
    let labels = arguments.labels.as_deref();
    if let Some(labels) = labels {
        let inner = place(labels);
        if inner.starts_with(&output) || output.starts_with(&inner) {
            return Err(format!(
                "--labels {}: give a folder of its own, neither in that of the results nor around it",
                labels.display()
            )
            .into());
        }
        TurnLabels::check(labels)?;
    }
    let asset = check_asset(arguments.asset.as_deref(), &output, labels)?;
    if !arguments.no_video {
        MovieWriter::check()?;
    }
    Ok(asset)
}

/// An asset takes the place of an earlier one, and of nothing else.
fn check_asset<'a>(
    path: Option<&'a Path>,
    output: &Path,
    labels: Option<&Path>,
) -> Result<AssetPlace<'a>, Box<dyn Error>> {
    let Some(path) = path else {
        return Ok(AssetPlace::None);
    };
    let refuse = |what: &str| Err(format!("--asset {}: {what}", path.display()).into());
    let is_asset = path
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("relit"));
    if !is_asset {
        return refuse("give a name that ends in .relit");
    }
    let inner = place(path);
    if labels.is_some_and(|labels| inner.starts_with(place(labels))) {
        return refuse("give a place that is not in the folder of the labels");
    }
    if inner == output.join(ASSET) {
        return Ok(AssetPlace::Inside);
    }
    if inner.starts_with(output) {
        return refuse("in the folder of the results the object is called object.relit");
    }
    CapturedObject::check(path)?;
    Ok(AssetPlace::Beside(path))
}

/// The path from the root, without links as far as it is there.
fn place(path: &Path) -> PathBuf {
    let path = absolute(path).unwrap_or_else(|_| path.to_owned());
    let there = path
        .ancestors()
        .find_map(|part| Some((part, fs::canonicalize(part).ok()?)));
    match there {
        Some((part, real)) => match path.strip_prefix(part) {
            // Joined with nothing, a path would end in a separator.
            Ok(rest) if rest.as_os_str().is_empty() => real,
            Ok(rest) => real.join(rest),
            Err(_) => path,
        },
        None => path,
    }
}
