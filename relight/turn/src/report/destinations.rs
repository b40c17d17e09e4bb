//! Where the results go, looked at before the work.

use std::fs;
use std::path::{Path, PathBuf, absolute};

use relight_core::captured_object::{CapturedObject, CapturedObjectError};
use relight_photo::files::{MovieError, MovieWriter};

use crate::error::TurnError;
use crate::report::files::{ASSET, TurnFiles};
use crate::report::labels::TurnLabels;

/// Where the results of a turn are to be written.
#[derive(Debug, Clone, Copy)]
pub struct Destinations<'a> {
    /// The folder for the results.
    pub output: &'a Path,
    /// The folder for labels.
    pub labels: Option<&'a Path>,
    /// The object as a file.
    pub asset: Option<&'a Path>,
    /// Whether there is to be a video.
    pub has_movie: bool,
}

/// Where the object is written as a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AssetDestination<'a> {
    /// Nowhere.
    None,
    /// Among the other results.
    Inside,
    /// Elsewhere.
    Beside(&'a Path),
}

/// Why results cannot be written where they are to be.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DestinationError {
    /// The folder of the results or that of the labels cannot be written.
    #[error(transparent)]
    Folder(#[from] TurnError),
    /// The labels and the results would be lost in each other.
    #[error("{}: give a folder of its own, neither in that of the results nor around it", .0.display())]
    Labels(PathBuf),
    /// The object cannot be written there.
    #[error("{}: {what}", path.display())]
    AssetPlace {
        /// The place.
        path: PathBuf,
        /// What to give instead.
        what: &'static str,
    },
    /// The object's file cannot be written.
    #[error(transparent)]
    Asset(#[from] CapturedObjectError),
    /// The video cannot be written.
    #[error(transparent)]
    Movie(#[from] MovieError),
}

impl<'a> Destinations<'a> {
    /// Refuses places that cannot be written, or of which one would be lost in another; where the object goes.
    ///
    /// # Errors
    /// With the first of them.
    pub fn check(&self) -> Result<AssetDestination<'a>, DestinationError> {
        let output = resolved(self.output);
        TurnFiles::check(self.output)?;
        if let Some(labels) = self.labels {
            let inner = resolved(labels);
            if inner.starts_with(&output) || output.starts_with(&inner) {
                return Err(DestinationError::Labels(labels.to_owned()));
            }
            TurnLabels::check(labels)?;
        }
        let asset = self.check_asset(&output)?;
        if self.has_movie {
            MovieWriter::check()?;
        }
        Ok(asset)
    }

    /// An object takes the place of an earlier one, and of nothing else.
    fn check_asset(&self, output: &Path) -> Result<AssetDestination<'a>, DestinationError> {
        let Some(path) = self.asset else {
            return Ok(AssetDestination::None);
        };
        let refuse = |what| {
            Err(DestinationError::AssetPlace {
                path: path.to_owned(),
                what,
            })
        };
        let is_asset = path
            .extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("relit"));
        if !is_asset {
            return refuse("give a name that ends in .relit");
        }
        let inner = resolved(path);
        let labels = self.labels.map(resolved);
        if labels.is_some_and(|labels| inner.starts_with(labels)) {
            return refuse("give a place that is not in the folder of the labels");
        }
        if inner == output.join(ASSET) {
            return Ok(AssetDestination::Inside);
        }
        if inner.starts_with(output) {
            return refuse("in the folder of the results the object is called object.relit");
        }
        CapturedObject::check(path)?;
        Ok(AssetDestination::Beside(path))
    }
}

/// The path from the root, without links as far as it is there.
fn resolved(path: &Path) -> PathBuf {
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
