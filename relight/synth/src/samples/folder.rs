//! A folder of samples.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::process;

use rayon::prelude::*;
use relit_data::durable::write_whole;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::recipe::Recipe;
use crate::SynthError;
use crate::library::Library;

/// The description of a folder of samples.
const FILE: &str = "synth.json";
/// Its schema.
const SCHEMA: &str = "relight.synth/1";

/// What a folder of samples was made of.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Origin {
    schema: String,
    software: String,
    recipe: Recipe,
    meshes: Vec<String>,
    panoramas: Vec<String>,
    pictures: usize,
}

impl Origin {
    fn new(recipe: &Recipe, library: &Library) -> Self {
        Self {
            schema: SCHEMA.to_owned(),
            software: format!("relight {}", env!("CARGO_PKG_VERSION")),
            recipe: recipe.clone(),
            meshes: library.mesh_names(),
            panoramas: library.panoramas.names(),
            pictures: library.pictures.len(),
        }
    }
}

/// How many samples were written, and how many were there already.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SynthSummary {
    /// Made by this call.
    pub new: u64,
    /// Whole already, by an earlier call with the same recipe.
    pub kept: u64,
}

/// Writes the samples 0 to `count - 1` of a recipe into the folder `out`, in parallel on rayon's
/// threads; `progress` is called for each finished sample. A sample's folder, `<number>` with six digits,
/// appears when all its files are in it. A call that was interrupted can be repeated, and goes on.
///
/// # Errors
/// If a setting is out of range, the folder holds something else or is being written, or a file
/// cannot be written: samples that are done stay.
pub fn write_samples(
    recipe: &Recipe,
    library: &Library,
    count: u64,
    out: &Path,
    progress: &(dyn Fn() + Sync),
) -> Result<SynthSummary, SynthError> {
    recipe.check()?;
    let folder = SampleFolder::open(out, FILE, &Origin::new(recipe, library))?;
    let each = recipe.samples_an_object();
    let objects = count.div_ceil(each);
    (0..objects)
        .into_par_iter()
        .map(|object| {
            let numbers = object * each..count.min((object + 1) * each);
            folder.write_object(recipe, library, numbers, progress)
        })
        .try_reduce(SynthSummary::default, |a, b| {
            Ok(SynthSummary {
                new: a.new + b.new,
                kept: a.kept + b.kept,
            })
        })
}

/// A folder of samples that this process alone writes into.
#[derive(Debug)]
pub struct SampleFolder {
    path: PathBuf,
    /// The lock lives as long as this handle.
    _handle: File,
}

impl SampleFolder {
    /// Opens a folder, made if missing, which the file `name` describes: it is empty, or its samples are of this origin.
    ///
    /// # Errors
    /// If it holds something else, or is being written.
    pub fn open<O: Serialize + DeserializeOwned + PartialEq>(
        path: &Path,
        name: &str,
        origin: &O,
    ) -> Result<Self, SynthError> {
        fs::create_dir_all(path).map_err(SynthError::write(path))?;
        let handle = File::open(path).map_err(SynthError::read(path))?;
        handle.try_lock().map_err(|reason| match reason {
            TryLockError::WouldBlock => SynthError::unusable(
                path,
                "is being written by another process: wait until it ends, or give another folder",
            ),
            TryLockError::Error(source) => SynthError::write(path)(source),
        })?;
        describe(path, name, origin)?;
        clear_leftovers(path)?;
        Ok(Self {
            path: path.to_owned(),
            _handle: handle,
        })
    }

    /// Writes the samples of one object that are not there.
    fn write_object(
        &self,
        recipe: &Recipe,
        library: &Library,
        numbers: std::ops::Range<u64>,
        progress: &(dyn Fn() + Sync),
    ) -> Result<SynthSummary, SynthError> {
        let mut written = SynthSummary::default();
        let missing: Vec<u64> = numbers
            .filter(|&number| {
                !self.has(&name_of(number)) || {
                    written.kept += 1;
                    progress();
                    false
                }
            })
            .collect();
        let Some(first) = missing.first() else {
            return Ok(written);
        };
        let (object, mesh) = recipe.object(library, first / recipe.samples_an_object());
        let lightings = u64::from(recipe.lightings);
        for of_view in missing.chunk_by(|a, b| a / lightings == b / lightings) {
            let view = recipe.view(&object, &mesh, of_view[0] / lightings);
            for &number in of_view {
                let files = recipe.sample(library, &view, number).files()?;
                self.write(&name_of(number), |folder| {
                    let mut files = files.iter();
                    files.try_for_each(|(name, bytes)| write_file(folder, name, bytes))
                })?;
                written.new += 1;
                progress();
            }
        }
        Ok(written)
    }

    /// Whether a sample is there, with all its files.
    pub fn has(&self, sample: &str) -> bool {
        self.path.join(sample).is_dir()
    }

    /// Writes a sample, whose folder appears when all its files are in it. `write` is given the folder meanwhile.
    ///
    /// # Errors
    /// Those of `write`, or if a folder cannot be written.
    pub fn write<E: From<SynthError>>(
        &self,
        sample: &str,
        write: impl FnOnce(&Path) -> Result<(), E>,
    ) -> Result<(), E> {
        write_folder(&self.path.join(sample), write)
    }
}

/// Writes a folder that appears when all its files are in it, in place of an older one. `write` is given it meanwhile.
pub(crate) fn write_folder<R, E: From<SynthError>>(
    place: &Path,
    write: impl FnOnce(&Path) -> Result<R, E>,
) -> Result<R, E> {
    let name = place.file_name().unwrap_or_default().to_string_lossy();
    let partial = place.with_file_name(format!(".{name}.{}.partial", process::id()));
    // What a killed process of this number left.
    let _ = fs::remove_dir_all(&partial);
    let written = || {
        fs::create_dir_all(&partial).map_err(SynthError::write(&partial))?;
        let result = write(&partial)?;
        if place.is_dir() {
            fs::remove_dir_all(place).map_err(SynthError::write(place))?;
        }
        fs::rename(&partial, place).map_err(SynthError::write(place))?;
        Ok(result)
    };
    written().inspect_err(|_| {
        // The first error is the one that counts.
        let _ = fs::remove_dir_all(&partial);
    })
}

/// Writes a file into such a folder.
pub(crate) fn write_file(folder: &Path, name: &str, bytes: &[u8]) -> Result<(), SynthError> {
    let path = folder.join(name);
    fs::write(&path, bytes).map_err(SynthError::write(&path))
}

fn name_of(number: u64) -> String {
    format!("{number:06}")
}

/// Whether a folder holds samples.
pub(crate) fn holds_samples(folder: &Path) -> bool {
    folder.join(FILE).exists()
}

/// Writes the description, or compares it with the existing one.
fn describe<O: Serialize + DeserializeOwned + PartialEq>(
    folder: &Path,
    name: &str,
    origin: &O,
) -> Result<(), SynthError> {
    let path = folder.join(name);
    let there = match fs::read(&path) {
        Ok(bytes) => serde_json::from_slice::<O>(&bytes)
            .map_err(|fault| SynthError::unusable(&path, format!("is damaged: {fault}")))?,
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let mut entries = fs::read_dir(folder).map_err(SynthError::read(folder))?;
            if entries.next().is_some() {
                let fault = format!(
                    "is not empty and has no {name}: give an empty folder, or one of `relight synth`"
                );
                return Err(SynthError::unusable(folder, fault));
            }
            let mut bytes = serde_json::to_vec_pretty(origin).unwrap_or_default();
            bytes.push(b'\n');
            return write_whole(&path, &bytes).map_err(SynthError::write(&path));
        }
        Err(source) => return Err(SynthError::read(&path)(source)),
    };
    if there == *origin {
        Ok(())
    } else {
        Err(SynthError::other_settings(folder))
    }
}

/// Removes what an interrupted call left.
fn clear_leftovers(folder: &Path) -> Result<(), SynthError> {
    for entry in fs::read_dir(folder).map_err(SynthError::read(folder))? {
        let path = entry.map_err(SynthError::read(folder))?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with('.') && name.ends_with(".partial") && path.is_dir() {
            fs::remove_dir_all(&path).map_err(SynthError::write(&path))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use rayon::ThreadPoolBuilder;

    use super::super::sample::{Description, WhiteLevels};
    use super::*;
    use crate::library::Folders;

    fn recipe() -> Recipe {
        Recipe {
            size: 40,
            views: 2,
            lightings: 3,
            ..Recipe::default()
        }
    }

    fn library() -> Library {
        Library::read(&Folders::default()).unwrap()
    }

    /// Every file below a folder, by its path.
    fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut files = BTreeMap::new();
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                let inner = contents(&path);
                let name = PathBuf::from(path.file_name().unwrap());
                files.extend(
                    inner
                        .into_iter()
                        .map(|(file, bytes)| (name.join(file), bytes)),
                );
            } else {
                let bytes = fs::read(&path).unwrap();
                files.insert(PathBuf::from(path.file_name().unwrap()), bytes);
            }
        }
        files
    }

    fn written(threads: usize, count: u64) -> BTreeMap<PathBuf, Vec<u8>> {
        let folder = tempfile::tempdir().unwrap();
        let pool = ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let library = library();
        let result =
            pool.install(|| write_samples(&recipe(), &library, count, folder.path(), &|| {}));
        assert_eq!(
            result.unwrap(),
            SynthSummary {
                new: count,
                kept: 0
            }
        );
        contents(folder.path())
    }

    #[test]
    fn the_number_of_threads_changes_no_byte() {
        let one = written(1, 20);
        assert_eq!(one.len(), 20 * 8 + 1);
        assert!(one == written(2, 20));
    }

    #[test]
    fn a_sample_s_files_tell_how_its_picture_came_about() {
        let folder = tempfile::tempdir().unwrap();
        write_samples(&recipe(), &library(), 8, folder.path(), &|| {}).unwrap();
        let mut compared = 0;
        for number in 0..8 {
            let sample = folder.path().join(format!("{number:06}"));
            let json = fs::read(sample.join("sample.json")).unwrap();
            let description: Description = serde_json::from_slice(&json).unwrap();
            let camera = &description.camera;
            if camera.jpeg.is_some() || camera.read_noise > 0.0 {
                continue;
            }
            let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
            let white: WhiteLevels = serde_json::from_value(json["white"].clone()).unwrap();
            let map = |name: &str| image::open(sample.join(name)).unwrap().into_rgb16();
            let [albedo, shading, highlight] =
                ["albedo.png", "shading.png", "highlight.png"].map(map);
            let picture = image::open(sample.join("image.png")).unwrap().into_rgb8();
            for (x, y, pixel) in picture.enumerate_pixels() {
                for channel in 0..3 {
                    let at = |map: &image::ImageBuffer<image::Rgb<u16>, Vec<u16>>, white: f32| {
                        f32::from(map.get_pixel(x, y).0[channel]) / 65_535.0 * white
                    };
                    let light = at(&albedo, 1.0) * at(&shading, white.shading)
                        + at(&highlight, white.highlight);
                    let value = camera.response.encode(light) * 255.0;
                    let error = (value - f32::from(pixel.0[channel])).abs();
                    // Near black a power's slope has no bound.
                    assert!(error <= 1.0 || light < 2e-4, "{number} ({x}, {y}): {error}");
                    compared += 1;
                }
            }
        }
        assert!(compared > 0);
    }

    #[test]
    fn an_interrupted_call_goes_on_and_clears_away_what_was_left() {
        let folder = tempfile::tempdir().unwrap();
        let library = library();
        write_samples(&recipe(), &library, 5, folder.path(), &|| {}).unwrap();
        fs::create_dir(folder.path().join(".000005.1.partial")).unwrap();
        fs::remove_dir_all(folder.path().join("000002")).unwrap();
        let again = write_samples(&recipe(), &library, 8, folder.path(), &|| {}).unwrap();
        assert_eq!(again, SynthSummary { new: 4, kept: 4 });
        assert!(contents(folder.path()) == written(1, 8));
    }

    #[test]
    fn a_folder_of_something_else_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("thesis.tex"), "").unwrap();
        let library = library();
        let error = write_samples(&recipe(), &library, 1, folder.path(), &|| {}).unwrap_err();
        assert!(matches!(error, SynthError::Unusable { .. }), "{error:?}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        let folder = tempfile::tempdir().unwrap();
        write_samples(&recipe(), &library, 1, folder.path(), &|| {}).unwrap();
        let other = Recipe {
            seed: 1,
            ..recipe()
        };
        let error = write_samples(&other, &library, 1, folder.path(), &|| {}).unwrap_err();
        assert!(matches!(error, SynthError::Unusable { .. }), "{error:?}");
    }

    #[test]
    fn a_sample_that_cannot_be_written_is_named_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let library = library();
        write_samples(&recipe(), &library, 1, folder.path(), &|| {}).unwrap();
        fs::write(folder.path().join("000001"), "in the way").unwrap();
        let error = write_samples(&recipe(), &library, 3, folder.path(), &|| {}).unwrap_err();
        assert!(error.to_string().contains("000001"), "{error}");
        let names = contents(folder.path());
        assert!(
            !names
                .keys()
                .any(|path| path.to_string_lossy().contains("partial"))
        );
    }
}
