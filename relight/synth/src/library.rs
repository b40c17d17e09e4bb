//! What a user brings: meshes and panoramas, read once.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::{fmt, fs};

use glam::Vec3;

use super::SynthError;
use super::lighting::Panoramas;
use super::lighting::studio::Surroundings;
use super::mesh::{Mesh, NOT_READ};
use super::pack::{self, PackedLibrary};
use super::texture::TextureImage;
use relight_core::image::Extent;
use relight_core::light::Panorama;
use relit_data::file_names::is_hidden;
use relit_data::statistics::ranked;

/// Size of the panoramas that are made here.
pub(crate) const PANORAMA_EXTENT: Extent = Extent::new(256, 128);
/// Size of panoramas as pictures.
const PICTURE_EXTENT: Extent = Extent::new(256, 128);
/// Seeds from which panoramas are made.
const VARIANTS: u64 = 4;

/// Meshes, pictures and panoramas to draw from.
#[derive(Debug, Clone, Default)]
pub struct Library {
    /// By file name, with its folders; empty: all objects are procedural.
    pub meshes: Vec<(String, Mesh)>,
    /// The panoramas as textures.
    pub(crate) pictures: Vec<TextureImage>,
    /// The panoramas, never none.
    pub panoramas: Panoramas,
    /// Unused files of the folders.
    pub left_out: Vec<SkippedFile>,
    /// Of meshes and panoramas from packed libraries, by name: whether they are for validation only.
    pub(crate) is_for_validation: BTreeMap<String, bool>,
}

/// Something of a user's own that is not used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SkippedFile {
    /// The file.
    pub path: PathBuf,
    /// The part, and the reason.
    pub what: String,
}

impl fmt::Display for SkippedFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.path.display(), self.what)
    }
}

/// Folders of a user's own files. In place of a folder of meshes or panoramas, a packed library (`.relib`) may be given.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Folders {
    /// `.obj`, `.gltf` and `.glb`, also in folders within it.
    pub meshes: Option<PathBuf>,
    /// `.hdr` and `.exr`; `None`: the synthetic ones.
    pub panoramas: Option<PathBuf>,
}

impl Library {
    /// Reads all files of the kinds in these folders, in the order of their names, and all of packed libraries: see
    /// [`Self::training`]. Where no folder of panoramas is given, 13 are made. Meshes of other kinds are left out.
    ///
    /// # Errors
    /// If a folder holds no file of its kind; whatever is wrong with a file.
    pub fn read(folders: &Folders) -> Result<Self, SynthError> {
        let mut is_for_validation = BTreeMap::new();
        let mut packed = |path: &Path| {
            let packed = PackedLibrary::read(path)?;
            is_for_validation.extend(packed.is_for_validation());
            Ok::<_, SynthError>(packed)
        };
        let (meshes, left_out) = match &folders.meshes {
            Some(path) if pack::is_packed(path) => (packed(path)?.meshes()?, Vec::new()),
            Some(folder) => read_meshes(folder)?,
            None => (Vec::new(), Vec::new()),
        };
        let panoramas = match &folders.panoramas {
            Some(path) if pack::is_packed(path) => packed(path)?.panoramas()?,
            Some(folder) => read_panoramas(folder)?,
            None => made_panoramas()?,
        };
        let panoramas = Panoramas::new(panoramas);
        let library = Self {
            meshes,
            pictures: pictures_of(&panoramas),
            panoramas,
            left_out,
            is_for_validation,
        };
        library.checked("all panoramas are black: give one with light")
    }

    /// A packed library from its bytes; errors name it as `path`.
    ///
    /// # Errors
    /// [`SynthError::Unusable`] if it is damaged.
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self, SynthError> {
        let packed = PackedLibrary::from_bytes(path, bytes)?;
        let panoramas = Panoramas::new(packed.panoramas()?);
        Ok(Self {
            pictures: pictures_of(&panoramas),
            meshes: packed.meshes()?,
            panoramas,
            left_out: Vec::new(),
            is_for_validation: packed.is_for_validation().collect(),
        })
    }

    /// The training part of packed libraries. Files of folders are in both parts.
    ///
    /// # Errors
    /// If no panorama is left.
    pub fn training(self) -> Result<Self, SynthError> {
        self.part(false)
    }

    /// The part of packed libraries that is for validation only: a tenth of the objects and of the panoramas.
    ///
    /// # Errors
    /// If no panorama is left.
    pub fn validation(self) -> Result<Self, SynthError> {
        self.part(true)
    }

    fn part(mut self, is_validation: bool) -> Result<Self, SynthError> {
        let marks = &self.is_for_validation;
        let belongs = |name: &str| marks.get(name).is_none_or(|&own| own == is_validation);
        self.meshes.retain(|(name, _)| belongs(name));
        self.panoramas.retain(belongs);
        self.pictures = pictures_of(&self.panoramas);
        self.checked("this part of the library has no panorama: give another library, or a folder of panoramas")
    }

    /// The same where there is light.
    fn checked(self, fault: &str) -> Result<Self, SynthError> {
        if self.panoramas.is_empty() {
            return Err(SynthError::Refused(fault.to_owned()));
        }
        Ok(self)
    }

    /// The names of its meshes.
    pub fn mesh_names(&self) -> Vec<String> {
        self.meshes.iter().map(|(name, _)| name.clone()).collect()
    }

    /// What seeds draw from: the names of its meshes and panoramas, a line each.
    pub fn identity(&self) -> String {
        let names = self.mesh_names().into_iter().chain(self.panoramas.names());
        names.map(|name| name + "\n").collect()
    }

    /// The same without its meshes: all shapes are made.
    pub fn without_meshes(&self) -> Self {
        Self {
            meshes: Vec::new(),
            pictures: self.pictures.clone(),
            panoramas: self.panoramas.clone(),
            left_out: Vec::new(),
            is_for_validation: self.is_for_validation.clone(),
        }
    }
}

/// The synthetic panoramas, by name: four each of studio, room and sky, and one even light.
///
/// # Errors
/// None with panoramas of any size; [`SynthError::Light`] is passed on.
pub fn made_panoramas() -> Result<Vec<(String, Panorama)>, SynthError> {
    let mut made = Vec::new();
    for kind in Surroundings::ALL {
        let variants = if kind == Surroundings::Even {
            1
        } else {
            VARIANTS
        };
        for seed in 0..variants {
            let panorama = kind
                .panorama(seed, PANORAMA_EXTENT)
                .map_err(SynthError::Light)?;
            made.push((format!("{}-{seed}", kind.name()), panorama));
        }
    }
    Ok(made)
}

/// The panoramas as pictures to lay onto objects.
fn pictures_of(panoramas: &Panoramas) -> Vec<TextureImage> {
    let numbers = 0..panoramas.len();
    let panoramas = numbers.filter_map(|number| panoramas.get(number));
    panoramas.map(picture_of).collect()
}

/// A panorama as a picture: its light up to what one pixel in ten exceeds.
fn picture_of(panorama: &Panorama) -> TextureImage {
    let small = panorama.resized(PICTURE_EXTENT);
    let planes = small.image().planes();
    let mut levels: Vec<f32> = planes.planes().into_iter().flatten().copied().collect();
    let place = levels.len() * 9 / 10;
    let level = ranked(&mut levels, place).unwrap_or_default();
    let scale = 1.0 / level.max(1e-6);
    let Extent { width, height } = PICTURE_EXTENT;
    TextureImage::from_fn(width, height, |x, y| {
        (Vec3::from_array(planes.pixel(x, y)) * scale).clamp(Vec3::splat(0.02), Vec3::ONE)
    })
}

/// Files that are looked for in a folder.
pub(crate) struct FileKind {
    what: &'static str,
    extensions: &'static [&'static str],
}

pub(crate) const MESHES: FileKind = FileKind {
    what: "meshes",
    extensions: &["obj", "gltf", "glb"],
};
/// Meshes that are not read: what else lies beside meshes are pictures and texts.
const OTHER_MESHES: FileKind = FileKind {
    what: "other meshes",
    extensions: &[
        "3ds", "3mf", "blend", "dae", "fbx", "ply", "stl", "usd", "usda", "usdc", "usdz",
    ],
};
pub(crate) const PANORAMAS: FileKind = FileKind {
    what: "panoramas",
    extensions: &["hdr", "exr"],
};

type NamedMeshes = Vec<(String, Mesh)>;

/// All meshes of a folder and its subfolders, and what of them is not used.
fn read_meshes(folder: &Path) -> Result<(NamedMeshes, Vec<SkippedFile>), SynthError> {
    let mut left_out = Vec::new();
    let mut meshes = Vec::new();
    for path in files_below(folder)? {
        if OTHER_MESHES.includes(&path) {
            left_out.push(SkippedFile {
                path,
                what: NOT_READ.to_owned(),
            });
            continue;
        }
        if !MESHES.includes(&path) {
            continue;
        }
        let mesh = Mesh::read(&path)?;
        left_out.extend(mesh.left_out.iter().map(|what| SkippedFile {
            path: path.clone(),
            what: what.clone(),
        }));
        let name = path.strip_prefix(folder).unwrap_or(&path);
        let parts: Vec<_> = name.iter().map(OsStr::to_string_lossy).collect();
        meshes.push((parts.join("/"), mesh));
    }
    if meshes.is_empty() {
        return Err(MESHES.missing(folder));
    }
    Ok((meshes, left_out))
}

/// The files of a folder and of those within it, by their paths; each folder once, where links lead in a circle.
pub(crate) fn files_below(folder: &Path) -> Result<Vec<PathBuf>, SynthError> {
    let mut files = Vec::new();
    let mut seen = BTreeSet::new();
    let mut waiting = vec![folder.to_owned()];
    while let Some(folder) = waiting.pop() {
        if !seen.insert(fs::canonicalize(&folder).map_err(SynthError::read(&folder))?) {
            continue;
        }
        for path in members(&folder)? {
            if path.is_dir() {
                waiting.push(path);
            } else {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

/// The entries of a folder, without hidden ones of the system.
fn members(folder: &Path) -> Result<Vec<PathBuf>, SynthError> {
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).map_err(SynthError::read(folder))? {
        let path = entry.map_err(SynthError::read(folder))?.path();
        if !is_hidden(&path) {
            paths.push(path);
        }
    }
    Ok(paths)
}

fn extension(path: &Path) -> Option<String> {
    Some(path.extension()?.to_str()?.to_ascii_lowercase())
}

impl FileKind {
    pub(crate) fn includes(&self, path: &Path) -> bool {
        extension(path).is_some_and(|found| self.extensions.contains(&found.as_str()))
    }

    pub(crate) fn missing(&self, folder: &Path) -> SynthError {
        let (what, extensions) = (self.what, self.extensions.join(", ."));
        let fault = format!("holds no {what}: put files in it that end in .{extensions}");
        SynthError::unusable(folder, fault)
    }
}

/// Every panorama of a folder, by name.
fn read_panoramas(folder: &Path) -> Result<Vec<(String, Panorama)>, SynthError> {
    let mut paths = members(folder)?;
    paths.retain(|path| PANORAMAS.includes(path));
    paths.sort();
    if paths.is_empty() {
        return Err(PANORAMAS.missing(folder));
    }
    let named = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default();
        Ok((name.to_string_lossy().into_owned(), Panorama::read(path)?))
    };
    paths.iter().map(named).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_folders_there_are_panoramas_and_no_meshes() {
        let library = Library::read(&Folders::default()).unwrap();
        assert!(library.meshes.is_empty());
        assert_eq!((library.panoramas.len(), library.pictures.len()), (13, 13));
        assert_eq!(library.panoramas.name(0), Some("studio-0"));
    }

    #[test]
    fn an_empty_folder_is_an_error_that_says_what_was_looked_for() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("readme.txt"), "no panorama").unwrap();
        let folders = Folders {
            panoramas: Some(folder.path().to_owned()),
            ..Folders::default()
        };
        let error = Library::read(&folders).unwrap_err().to_string();
        assert!(
            error.contains("panoramas") && error.contains("exr"),
            "{error}"
        );
    }

    #[test]
    fn a_damaged_mesh_among_good_ones_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let good = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        std::fs::write(folder.path().join("a.obj"), good).unwrap();
        std::fs::write(folder.path().join("b.OBJ"), "v 0 0\n").unwrap();
        let folders = Folders {
            meshes: Some(folder.path().to_owned()),
            ..Folders::default()
        };
        let error = Library::read(&folders).unwrap_err().to_string();
        assert!(error.contains("b.OBJ"), "{error}");
        std::fs::remove_file(folder.path().join("b.OBJ")).unwrap();
        assert_eq!(Library::read(&folders).unwrap().meshes[0].0, "a.obj");
    }

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

    /// A folder of meshes with files of these contents.
    fn folder_with(files: &[(&str, &str)]) -> (tempfile::TempDir, Folders) {
        let folder = tempfile::tempdir().unwrap();
        for (name, content) in files {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, content).unwrap();
        }
        let folders = Folders {
            meshes: Some(folder.path().to_owned()),
            ..Folders::default()
        };
        (folder, folders)
    }

    #[test]
    fn meshes_are_found_in_folders_within_and_not_among_hidden_files() {
        let (_folder, folders) = folder_with(&[
            ("chairs/oak/chair.obj", TRIANGLE),
            ("a.OBJ", TRIANGLE),
            ("._a.obj", "of macOS"),
            (".trash/b.obj", "deleted"),
            ("chairs/readme.txt", "text"),
            ("chairs/oak/chair.mtl", ""),
        ]);
        let library = Library::read(&folders).unwrap();
        let names: Vec<&str> = library
            .meshes
            .iter()
            .map(|(name, _)| name.as_str())
            .collect();
        assert_eq!(names, ["a.OBJ", "chairs/oak/chair.obj"]);
        assert!(library.left_out.is_empty());
    }

    #[test]
    fn meshes_of_other_kinds_and_what_meshes_miss_are_left_out_and_named() {
        let missing = format!("mtllib none.mtl\nusemtl a\n{TRIANGLE}");
        let (folder, folders) = folder_with(&[
            ("a.obj", &missing),
            ("b.ply", "ply"),
            ("c/d.STL", "solid"),
            ("e.usdz", ""),
            ("photo.png", ""),
        ]);
        let library = Library::read(&folders).unwrap();
        let of = |one: &SkippedFile| one.path.strip_prefix(folder.path()).unwrap().to_owned();
        let mut paths: Vec<PathBuf> = library.left_out.iter().map(of).collect();
        paths.sort();
        assert_eq!(
            paths,
            ["a.obj", "b.ply", "c/d.STL", "e.usdz"].map(PathBuf::from)
        );
        assert!(library.left_out.iter().all(|one| !one.what.is_empty()));
        assert!(library.without_meshes().left_out.is_empty());
    }

    #[cfg(unix)]
    #[test]
    fn links_that_lead_in_a_circle_are_followed_once() {
        let (folder, folders) = folder_with(&[("a/b.obj", TRIANGLE)]);
        std::os::unix::fs::symlink(folder.path(), folder.path().join("a/again")).unwrap();
        assert_eq!(Library::read(&folders).unwrap().meshes.len(), 1);
    }
}
