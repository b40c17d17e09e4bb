//! Photographs in files, folders and shards.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use relight_core::image::{Extent, ImageError, Planes, Rgb, StoredImage, Transfer};
use relight_core::reader::{Encoding, SampleId, Source, Turns};
use relit_data::file_names::{folded, has_extension, is_hidden, name_differing_in_case};
use relit_data::geometry::Rect;
use relit_data::shard::Dataset;
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

/// Where a photograph is.
#[derive(Clone)]
pub enum PhotoInput {
    /// In a file.
    File(PathBuf),
    /// In a shard.
    Frame(Arc<Turns>, SampleId),
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
    /// The photographs of files, of folders of photographs or shards, and of shards (`*.tar`), of each
    /// turn the first `most`.
    ///
    /// # Errors
    /// If a folder cannot be read or holds none, a shard cannot be opened, or two photographs would
    /// be written to one folder.
    pub fn find(paths: &[PathBuf], most: Option<u32>) -> Result<PhotoList, DecomposeError> {
        let (mut found, mut unused) = (Vec::new(), Vec::new());
        for path in paths {
            if path.is_dir() {
                add_folder(&mut found, &mut unused, path, most)?;
            } else if has_extension(path, &["tar"]) {
                add_turns(&mut found, path, most)?;
            } else {
                found.push((path.clone(), Self::File(path.clone())));
            }
        }
        check_names(&found)?;
        Ok(PhotoList {
            inputs: found.into_iter().map(|(_, input)| input).collect(),
            unused,
        })
    }

    /// Whether a path is a shard, or a folder with shards or another data set of turns: their frames have
    /// masks of their own.
    pub fn has_frames(path: &Path) -> bool {
        if !path.is_dir() {
            return has_extension(path, &["tar"]);
        }
        let is_shard = |path: PathBuf| !is_hidden(&path) && has_extension(&path, &["tar"]);
        let entries = fs::read_dir(path).into_iter().flatten().flatten();
        path.join(Dataset::FILE).is_file() || entries.map(|entry| entry.path()).any(is_shard)
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
        match self {
            Self::File(path) => path.display().to_string(),
            Self::Frame(turns, id) => {
                let turn = turns.names().nth(id.turn as usize).unwrap_or_default();
                format!("{turn}, sample {}", id.position)
            }
        }
    }

    /// Reads the photograph, and its mask: that of `reading`, or its alpha, or the object within the rectangle, or what is
    /// not black before a black background. A frame of a shard has its own.
    ///
    /// # Errors
    /// If a file cannot be read or does not fit, or the object's place is unknown.
    pub fn load(&self, reading: &PhotoReading) -> Result<Photo, DecomposeError> {
        match self {
            Self::File(path) => read_file(path, reading),
            Self::Frame(turns, id) => read_frame(turns, *id),
        }
    }
}

/// Photographs, each with its path, or that of its data set.
type Found = Vec<(PathBuf, PhotoInput)>;

fn add_folder(
    found: &mut Found,
    unused: &mut Vec<UnusedFile>,
    folder: &Path,
    most: Option<u32>,
) -> Result<(), DecomposeError> {
    let has_frames = PhotoInput::has_frames(folder);
    let unused_before = unused.len();
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(DecomposeError::read(folder))? {
        let path = entry.map_err(DecomposeError::read(folder))?.path();
        if is_hidden(&path) {
            continue;
        }
        // A data set has folders of its own.
        if path.is_file() {
            files.push(path);
        } else if !has_frames && holds_pictures(&path) {
            let what = "is not used: it is a subfolder; name it as a photograph folder of its own";
            unused.push(UnusedFile::new(path, what));
        }
    }
    files.sort();
    unused[unused_before..].sort_by(|one, other| one.path.cmp(&other.path));
    let before = found.len();
    for path in files {
        match use_of(path.clone()) {
            None => found.push((path.clone(), PhotoInput::File(path))),
            // A data set has files of other kinds too.
            Some(_) if has_frames => {}
            Some(file) => unused.push(file),
        }
    }
    if found.len() == before && !has_frames {
        let other = unused.get(unused_before);
        let other = other.map_or_else(String::new, |other| format!("; {}", other.message));
        return Err(DecomposeError::file(
            folder,
            format!(
                "holds no photographs (PNG, JPEG, WebP, TIFF, BMP, GIF, EXR, HDR) and no shards (.tar){other}"
            ),
        ));
    }
    if has_frames {
        add_turns(found, folder, most)?;
    }
    Ok(())
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

fn add_turns(found: &mut Found, path: &Path, most: Option<u32>) -> Result<(), DecomposeError> {
    let turns = Arc::new(Turns::open(path, Encoding::Linear)?);
    for (turn, samples) in (0..).zip(turns.turns()) {
        for position in 0..samples.min(most.unwrap_or(u32::MAX)) {
            let id = SampleId { turn, position };
            found.push((path.to_owned(), PhotoInput::Frame(Arc::clone(&turns), id)));
        }
    }
    Ok(())
}

/// Checks that every file and every turn has its own folder for results, also if a file system ignores case.
fn check_names(inputs: &Found) -> Result<(), DecomposeError> {
    let mut names = BTreeMap::new();
    let mut last_turn = None;
    for (path, input) in inputs {
        let name = match input {
            PhotoInput::File(path) => Some(stem(path)),
            PhotoInput::Frame(turns, id) => {
                let turn = (Arc::as_ptr(turns), id.turn);
                if last_turn.replace(turn) == Some(turn) {
                    continue;
                }
                session_of(turns, id.turn)
            }
        };
        let Some(name) = name else { continue };
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

/// The folder of a turn's results: the first part of its frames' keys, by the first frame that can be read.
fn session_of(turns: &Turns, turn: u32) -> Option<String> {
    let samples = *turns.turns().get(turn as usize)?;
    let key = |position| {
        let (batch, _) = turns.batch(&[SampleId { turn, position }], None);
        batch.frames.first().map(|frame| within(&frame.key))
    };
    let key = (0..samples).find_map(key)?;
    key.split('/').next().map(str::to_owned)
}

fn read_file(path: &Path, reading: &PhotoReading) -> Result<Photo, DecomposeError> {
    let bytes = fs::read(path).map_err(ImageError::open(path))?;
    let mask = match &reading.mask {
        Some(file) => {
            let file = mask_file(file, &stem(path))?;
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
    Photo::from_bytes(path, &bytes, &hints)
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

/// A frame's key as a path that leads nowhere else.
fn within(key: &str) -> String {
    let parts = Path::new(key).components().filter_map(|part| match part {
        Component::Normal(name) => Some(name.to_string_lossy()),
        _ => None,
    });
    parts.collect::<Vec<_>>().join("/")
}

fn read_frame(turns: &Turns, id: SampleId) -> Result<Photo, DecomposeError> {
    let (batch, mut damage) = turns.batch(&[id], None);
    if let Some(damage) = damage.pop() {
        return Err(damage.into());
    }
    let Extent { width, height } = batch.extent;
    let pixels = width * height;
    let [red, green, blue] = [0, 1, 2].map(|c| batch.images[c * pixels..][..pixels].to_vec());
    let frame = batch.frames.first();
    let record = frame.and_then(|frame| frame.record.as_ref());
    Photo::from_frame(
        frame.map(|frame| within(&frame.key)).unwrap_or_default(),
        Rgb::new(Planes::from_planes(batch.extent, [red, green, blue])?),
        Planes::from_planes(batch.extent, [batch.masks])?,
        record.map(|record| record.saturated_fraction),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_key_of_a_frame_leads_nowhere_but_into_the_folder_for_results() {
        assert_eq!(
            within("20261120T093015Z-mug/0007"),
            "20261120T093015Z-mug/0007"
        );
        assert_eq!(within("../../etc/./passwd"), "etc/passwd");
        assert_eq!(within("/tmp/x"), "tmp/x");
    }
}
