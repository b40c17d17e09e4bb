//! What a user brings: meshes, textures and panoramas, read once.

use std::path::{Path, PathBuf};

use glam::Vec3;

use super::SynthError;
use super::lighting::Panoramas;
use super::mesh::Mesh;
use super::studio::Surroundings;
use super::texture::TextureImage;
use relight_core::image::Extent;
use relight_core::light::Panorama;
use relight_core::statistics::ranked;

/// Size of the panoramas that are made here.
pub const PANORAMA_EXTENT: Extent = Extent::new(256, 128);
/// Size of panoramas as pictures.
const PICTURE_EXTENT: Extent = Extent::new(256, 128);
/// Seeds of which panoramas are made.
const VARIANTS: u64 = 4;

/// Meshes, pictures and panoramas to draw from.
#[derive(Debug, Clone, Default)]
pub struct Library {
    /// By file name; none: all objects are procedural.
    pub meshes: Vec<(String, Mesh)>,
    /// Textures, and panoramas as textures.
    pub pictures: Vec<TextureImage>,
    /// The panoramas, never none.
    pub panoramas: Panoramas,
}

/// Folders of a user's own files.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Folders {
    /// `.obj`, `.gltf` and `.glb`.
    pub meshes: Option<PathBuf>,
    /// `.png` and `.jpg`, sRGB.
    pub textures: Option<PathBuf>,
    /// `.hdr` and `.exr`; none: those that are made here.
    pub panoramas: Option<PathBuf>,
}

impl Library {
    /// Reads all files of the kinds in these folders, in the order of their names. Where no folder of
    /// panoramas is given, 13 are made.
    ///
    /// # Errors
    /// [`SynthError::Nothing`] where a folder holds no file of its kind; whatever is wrong with a file.
    pub fn read(folders: &Folders) -> Result<Self, SynthError> {
        let meshes = match &folders.meshes {
            Some(folder) => read_all(folder, "meshes", &["obj", "gltf", "glb"], Mesh::read)?,
            None => Vec::new(),
        };
        let textures = match &folders.textures {
            Some(folder) => read_all(
                folder,
                "textures",
                &["png", "jpg", "jpeg"],
                TextureImage::read,
            )?,
            None => Vec::new(),
        };
        let panoramas = match &folders.panoramas {
            Some(folder) => read_all(folder, "panoramas", &["hdr", "exr"], |path| {
                Panorama::read(path).map_err(SynthError::Panorama)
            })?,
            None => made_panoramas()?,
        };
        let mut pictures: Vec<TextureImage> =
            textures.into_iter().map(|(_, picture)| picture).collect();
        pictures.extend(panoramas.iter().map(|(_, panorama)| picture_of(panorama)));
        let panoramas = Panoramas::new(panoramas);
        if panoramas.is_empty() {
            return Err(SynthError::Dark);
        }
        Ok(Self {
            meshes,
            pictures,
            panoramas,
        })
    }

    /// The same without its meshes: all shapes are made.
    #[must_use]
    pub fn without_meshes(&self) -> Self {
        Self {
            meshes: Vec::new(),
            pictures: self.pictures.clone(),
            panoramas: self.panoramas.clone(),
        }
    }
}

/// The panoramas that are made here, by name: four each of studio, room and sky, and one even light.
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

/// Every file of these extensions in a folder, by name.
fn read_all<T>(
    folder: &Path,
    what: &'static str,
    extensions: &'static [&'static str],
    read: impl Fn(&Path) -> Result<T, SynthError>,
) -> Result<Vec<(String, T)>, SynthError> {
    let entries = std::fs::read_dir(folder).map_err(SynthError::read(folder))?;
    let mut paths = Vec::new();
    for entry in entries {
        let path = entry.map_err(SynthError::read(folder))?.path();
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        if extensions.iter().any(|&wanted| extension == wanted) {
            paths.push(path);
        }
    }
    paths.sort();
    if paths.is_empty() {
        return Err(SynthError::Nothing {
            path: folder.to_owned(),
            what,
            extensions,
        });
    }
    let named = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default();
        Ok((name.to_string_lossy().into_owned(), read(path)?))
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
            error.contains("no panoramas") && error.contains("exr"),
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
}
