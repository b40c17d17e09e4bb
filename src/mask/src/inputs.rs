//! What the masks of a call are made of, and where they go.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs;
use std::path::{MAIN_SEPARATOR, Path, PathBuf};

use relit_data::file_names::folded;
use relit_data::session::{
    MANIFEST_FILE, MASK_SUFFIX, SessionError, beside_recordings, clips, hidden_recordings,
    mask_stem, recordings,
};
use relit_data::still::is_named;

use super::files::read_record;
use super::{MaskFiles, MaskingError};

/// What follows a mask's name in its file's and in those that go with it.
const ENDINGS: [&str; 6] = [
    ".png",
    ".json",
    "-preview.png",
    "-previous.json",
    "-check.html",
    "-check.json",
];

/// Where masks are written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MaskTarget {
    /// One mask.
    File(MaskFiles),
    /// A folder: each mask has the name of its recording.
    Folder(PathBuf),
}

impl MaskTarget {
    /// The mask that a path names, which ends in `.png`; otherwise a folder, which may be new if it has no ending, or a
    /// separator behind it.
    ///
    /// # Errors
    /// [`MaskingError::OutputName`].
    pub fn from_path(path: &Path) -> Result<Self, MaskingError> {
        let text = path.as_os_str().to_string_lossy();
        let ends_as_folder = text.ends_with(['/', MAIN_SEPARATOR]);
        let is_name = path.extension().is_none() && path.file_name().is_some();
        if path.is_dir() || (ends_as_folder || is_name) && !path.is_file() {
            Ok(Self::Folder(path.to_owned()))
        } else {
            MaskFiles::from_mask_path(path).map(Self::File)
        }
    }
}

/// The recordings to mask, and the other files next to them.
#[derive(Debug, Default)]
pub struct MaskInputs {
    /// Session folders, videos and photographs.
    pub recordings: Vec<PathBuf>,
    /// What else is in the folders that were searched.
    pub strays: Vec<PathBuf>,
    /// Inputs that hold no recording, and why.
    pub faults: Vec<(PathBuf, SessionError)>,
    /// Whether a mask that is named after nothing could be that of several.
    are_several: bool,
    /// The masks that were named so far, as a file system sees them that ignores case.
    named: BTreeSet<String>,
}

impl MaskInputs {
    /// All recordings in the inputs: sessions, videos, photographs, and folders of them.
    #[must_use]
    pub fn find(inputs: &[PathBuf], target: Option<&MaskTarget>) -> Self {
        let mut found = Self::default();
        for input in inputs {
            if let Err(error) = found.search(input, target) {
                found.faults.push((input.clone(), error));
            }
        }
        found.are_several |= found.recordings.len() > 1;
        found
    }

    fn search(&mut self, input: &Path, target: Option<&MaskTarget>) -> Result<(), SessionError> {
        let into_folder = match target {
            Some(MaskTarget::Folder(folder)) => Some(folder.as_path()),
            _ => None,
        };
        let inside = if into_folder.is_some() {
            clips(input)
        } else {
            recordings(input)
        };
        let (inside, beside) = match inside {
            Ok(inside) if inside == [input] => (inside, hidden_recordings(input)),
            Ok(inside) => (inside, beside_recordings(input)?),
            Err(_) => match photographs(input)? {
                (photographs, _) if photographs.is_empty() => return Err(nothing_to_mask(input)),
                found => found,
            },
        };
        self.are_several |= inside != [input];
        self.recordings.extend(inside);
        let strays = beside.into_iter().filter(|path| {
            !is_of_mask(path) && !into_folder.is_some_and(|folder| is_same(path, folder))
        });
        self.strays.extend(strays);
        Ok(())
    }

    /// The files of the mask of `recording`, where they are not those of its session folder or, for a single file,
    /// `mask.png` in the working directory.
    ///
    /// # Errors
    /// [`MaskingError::OutputName`]; [`MaskingError::Refused`] if another recording of these has the same name.
    pub fn files_of(
        &mut self,
        recording: &Path,
        target: Option<&MaskTarget>,
    ) -> Result<Option<MaskFiles>, MaskingError> {
        let mut name = mask_stem(recording);
        let folder = match target {
            Some(MaskTarget::File(files)) => return Ok(Some(files.clone())),
            Some(MaskTarget::Folder(folder)) => folder.as_path(),
            None if self.are_several && !recording.is_dir() => {
                name.push(MASK_SUFFIX);
                Path::new("")
            }
            None => return Ok(None),
        };
        name.push(".png");
        let files = MaskFiles::from_mask_path(&folder.join(name))?;
        for path in [&files.preview, &files.mask] {
            if !self.named.insert(folded(&path.to_string_lossy())) {
                return Err(MaskingError::Refused(format!(
                    "{} is also that of another input of this call: rename one, or mask it in a call of its own with -o",
                    path.display()
                )));
            }
        }
        Ok(Some(files))
    }
}

fn nothing_to_mask(input: &Path) -> SessionError {
    let why = if input.exists() {
        "has nothing to mask"
    } else {
        "does not exist"
    };
    SessionError::Unusable(format!(
        "{} {why}: give a session folder, a video, a photograph, or a folder of them",
        input.display()
    ))
}

/// The photographs in a folder that is not a session, sorted by name, and the other files next to them. Masks that were made
/// of them are neither.
fn photographs(folder: &Path) -> Result<(Vec<PathBuf>, Vec<PathBuf>), SessionError> {
    if !folder.is_dir() || folder.join(MANIFEST_FILE).exists() {
        return Ok(Default::default());
    }
    let beside = beside_recordings(folder)?;
    let is_photograph = |path: &PathBuf| path.is_file() && is_named(path);
    let (pictures, others): (Vec<_>, Vec<_>) = beside.into_iter().partition(is_photograph);
    let photographs = pictures.into_iter().filter(|path| !is_of_mask(path));
    Ok((photographs.collect(), others))
}

/// Whether a file is a mask that this program made, or goes with one, by its record.
fn is_of_mask(path: &Path) -> bool {
    let name = path.file_name().and_then(OsStr::to_str);
    let name = name.unwrap_or_default();
    let mut stems = ENDINGS
        .iter()
        .filter_map(|ending| name.strip_suffix(ending));
    stems.any(|stem| {
        let record = path.with_file_name(format!("{stem}.json"));
        matches!(read_record(&record), Ok(Some(_)))
    })
}

fn is_same(path: &Path, other: &Path) -> bool {
    let [path, other] = [path, other].map(|path| fs::canonicalize(path).ok());
    path.is_some() && path == other
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_is_a_png_or_a_folder() {
        let folder = tempfile::tempdir().unwrap();
        let dotted = folder.path().join("masks.v2");
        fs::create_dir(&dotted).unwrap();
        for path in [
            Path::new("masks"),
            Path::new("a/masks.v3/"),
            Path::new("."),
            &dotted,
        ] {
            let target = MaskTarget::from_path(path).unwrap();
            assert_eq!(target, MaskTarget::Folder(path.to_owned()));
        }
        let file = MaskTarget::from_path(Path::new("a/mug.PNG")).unwrap();
        assert!(matches!(file, MaskTarget::File(_)));
        for path in ["mask.jpg", ""] {
            let target = MaskTarget::from_path(Path::new(path));
            assert!(matches!(target, Err(MaskingError::OutputName(_))), "{path}");
        }
    }
}
