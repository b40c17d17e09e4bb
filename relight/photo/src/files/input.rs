//! Photographs in files and folders.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use relight_core::image::{ImageError, StoredImage, Transfer};
use relit_data::file_names::{folded, has_extension, is_hidden, name_differing_in_case};
use relit_data::geometry::Rect;
use relit_data::still::{Format, is_named};

use super::results::FIGURES;
use crate::decompose::{DecomposeError, Photo, PhotoHints, stem};

/// Bytes of a file that show its format.
const HEAD: u64 = 4096;

/// How photographs are read.
#[derive(Debug, Clone, Default)]
pub struct PhotoReading {
    /// A file with the mask, or a folder with one of the photograph's name, `<name>.png`.
    pub mask: Option<PathBuf>,
    /// A rectangle around the object, which is cut out within it.
    pub rectangle: Option<Rect>,
    /// How integers are encoded, where the file is not to be asked.
    pub transfer: Option<Transfer>,
}

impl PhotoReading {
    /// The mask of a photograph of this name: the given file, or the photograph's in the given folder, `NAME.png` or
    /// `NAME-mask.png`.
    pub fn mask_path(given: &Path, name: &str) -> PathBuf {
        if !given.is_dir() {
            return given.to_owned();
        }
        let [own, suffixed] = ["", "-mask"].map(|end| given.join(format!("{name}{end}.png")));
        if !own.is_file() && suffixed.is_file() {
            suffixed
        } else {
            own
        }
    }
}

/// A photograph in a file.
#[derive(Debug, Clone)]
pub struct PhotoInput {
    /// The file.
    pub path: PathBuf,
}

/// The photographs that paths lead to.
#[derive(Default)]
pub struct PhotoList {
    /// The photographs.
    pub inputs: Vec<PhotoInput>,
    /// The other files of the folders, apart from what operating systems leave behind.
    pub unused: Vec<UnusedFile>,
}

/// A file in a folder of photographs that is not read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnusedFile {
    /// The file.
    pub path: PathBuf,
    /// Why, as a sentence that names it.
    pub message: String,
}

impl UnusedFile {
    fn new(path: PathBuf, what: &str) -> Self {
        let message = format!("{} {what}", path.display());
        Self { path, message }
    }
}

impl PhotoInput {
    /// The photographs of files, and of folders of them.
    ///
    /// # Errors
    /// If a folder cannot be read or holds none, a file is a shard, or two photographs would be written to one folder.
    pub fn find(paths: &[PathBuf]) -> Result<PhotoList, DecomposeError> {
        let mut found = PhotoList::default();
        for path in paths {
            if path.is_dir() {
                found.add_folder(path)?;
            } else if has_extension(path, &["tar"]) {
                let fault = "is not a photograph: unpack the shard, or decompose its turn with relight turn";
                return Err(DecomposeError::file(path, fault));
            } else {
                found.inputs.push(Self { path: path.clone() });
            }
        }
        check_names(&found.inputs)?;
        Ok(found)
    }

    /// Whether a result that is named after a photograph, in a folder of several, leaves those of other photographs as they
    /// are, also where a file system ignores case.
    ///
    /// # Errors
    /// If it does not, or the folder cannot be listed.
    pub fn check_result(path: &Path) -> Result<(), DecomposeError> {
        match name_differing_in_case(path).map_err(DecomposeError::read(path))? {
            None => Ok(()),
            Some(other) => Err(DecomposeError::Photo(format!(
                "{} would replace {} where a file system ignores case: rename the photograph, or give another folder with \
                 --output",
                path.display(),
                path.with_file_name(other).display()
            ))),
        }
    }

    /// How an error names it.
    pub fn place(&self) -> String {
        self.path.display().to_string()
    }

    /// Reads the photograph, and its mask: that of `reading`, or its alpha, or the object within the rectangle, or what is
    /// not black before a black background.
    ///
    /// # Errors
    /// If a file cannot be read or does not fit, or the object's place is unknown.
    pub fn load(&self, reading: &PhotoReading) -> Result<Photo, DecomposeError> {
        let bytes = fs::read(&self.path).map_err(ImageError::open(&self.path))?;
        let mask = match &reading.mask {
            Some(file) => {
                let file = mask_file(file, &stem(&self.path))?;
                let image = StoredImage::read(&file)?;
                Some((file, image))
            }
            None => None,
        };
        let hints = PhotoHints {
            mask: mask.as_ref().map(|(file, image)| (file.as_path(), image)),
            rectangle: reading.rectangle,
            transfer: reading.transfer,
        };
        Photo::from_bytes(&self.path, &bytes, &hints)
    }
}

impl PhotoList {
    fn add_folder(&mut self, folder: &Path) -> Result<(), DecomposeError> {
        let mut unused = Vec::new();
        let mut files = Vec::new();
        for entry in fs::read_dir(folder).map_err(DecomposeError::read(folder))? {
            let path = entry.map_err(DecomposeError::read(folder))?.path();
            if is_hidden(&path) {
                continue;
            }
            if path.is_file() {
                files.push(path);
            } else if holds_pictures(&path) {
                let what =
                    "is not used: it is a subfolder; name it as a photograph folder of its own";
                unused.push(UnusedFile::new(path, what));
            }
        }
        files.sort();
        unused.sort_by(|one, other| one.path.cmp(&other.path));
        let before = self.inputs.len();
        for path in files {
            match use_of(path.clone()) {
                None => self.inputs.push(PhotoInput { path }),
                Some(file) => unused.push(file),
            }
        }
        if self.inputs.len() == before {
            let other = unused.first();
            let other = other.map_or_else(String::new, |other| format!("; {}", other.message));
            return Err(DecomposeError::file(
                folder,
                format!("holds no photographs (PNG, JPEG, WebP, TIFF, BMP, GIF, EXR, HDR){other}"),
            ));
        }
        self.unused.append(&mut unused);
        Ok(())
    }
}

/// Whether a folder within another holds pictures that a person may have meant; a result's are not.
fn holds_pictures(folder: &Path) -> bool {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let is_picture = |path: PathBuf| !is_hidden(&path) && is_named(&path);
    !folder.join(FIGURES).exists() && entries.map(|entry| entry.path()).any(is_picture)
}

/// Why a file of a folder is left out; `None` if it counts as a photograph: by its content, or by a name that
/// promises one, so that reading it reports the fault.
fn use_of(path: PathBuf) -> Option<UnusedFile> {
    let mut head = Vec::new();
    let file = fs::File::open(&path);
    // What cannot be read is known by its name alone.
    let _ = file.and_then(|file| file.take(HEAD).read_to_end(&mut head));
    match Format::sniff(&head) {
        Some(format) => {
            let (name, advice) = format.unsupported()?;
            let what = format!("is {name}, which is not read: {advice}");
            Some(UnusedFile::new(path, &what))
        }
        None if is_named(&path) => None,
        None => Some(UnusedFile::new(path, "is not used: it is not a picture")),
    }
}

/// Checks that every file has its own folder for results, also if a file system ignores case.
fn check_names(inputs: &[PhotoInput]) -> Result<(), DecomposeError> {
    let mut names = BTreeMap::new();
    for PhotoInput { path } in inputs {
        let name = stem(path);
        if let Some(first) = names.insert(folded(&name), path) {
            return Err(DecomposeError::Photo(format!(
                "{} and {} would both be written to {name} (case is ignored): rename one, or decompose them in two runs with \
                 different --output",
                first.display(),
                path.display()
            )));
        }
    }
    Ok(())
}

fn mask_file(given: &Path, name: &str) -> Result<PathBuf, DecomposeError> {
    let path = PhotoReading::mask_path(given, name);
    if !given.is_dir() || path.is_file() {
        Ok(path)
    } else {
        Err(DecomposeError::Photo(format!(
            "the photograph's mask {} is missing",
            path.display()
        )))
    }
}
