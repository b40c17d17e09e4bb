//! A scene with all that it needs in one ZIP archive: `scene.toml` as `relight insert --scene` reads it, photographs, masks and
//! the background. Entries are stored without compression.

use std::collections::BTreeMap;
use std::io::{Cursor, Read, Write};
use std::path::{Path, PathBuf};

use relight_photo::compositing::SceneDescription;
use relit_data::text;
use relit_grabcut::grey_png;
use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use super::background::StudioBackground;
use super::error::{StudioError, refused};
use super::object::{StudioObject, stem};
use super::page_scene::ObjectFiles;

/// The description's entry.
const SCENE: &str = "scene.toml";
/// The most that an archive unpacks to, bytes.
const MAX_BYTES: u64 = 256_000_000;
const TOO_LARGE: &str = "the archive is too large: it holds more than 256 MB";

/// The files of a scene by their names in an archive.
#[derive(Default)]
pub(super) struct SceneFiles {
    entries: BTreeMap<String, Vec<u8>>,
}

impl SceneFiles {
    /// Adds an object's files; their names.
    ///
    /// # Errors
    /// If its mask cannot be encoded.
    pub(super) fn add_object(&mut self, object: &StudioObject) -> Result<ObjectFiles, StudioError> {
        let photo = self.add(&object.name, object.file.clone());
        let mask = match object.mask_file() {
            Some(mask) => {
                let name = format!("{}-mask.png", stem(&photo));
                Some(self.add(&name, grey_png(mask, "the mask")?))
            }
            None => None,
        };
        Ok(ObjectFiles {
            photo: photo.into(),
            mask: mask.map(PathBuf::from),
            transfer: object.transfer,
        })
    }

    /// Adds the background's file; its name.
    ///
    /// # Errors
    /// If it cannot be encoded.
    pub(super) fn add_background(
        &mut self,
        background: &StudioBackground,
    ) -> Result<PathBuf, StudioError> {
        Ok(self.add(&background.name, background.file()?).into())
    }

    /// Adds a file under a unique name; files with the same content become one.
    fn add(&mut self, name: &str, content: Vec<u8>) -> String {
        let plain = plain_name(name);
        let (stem, ending) = plain.rsplit_once('.').unwrap_or((&plain, "bin"));
        let mut number = 1;
        loop {
            let name = if number == 1 {
                format!("{stem}.{ending}")
            } else {
                format!("{stem}-{number}.{ending}")
            };
            match self.entries.get(&name) {
                Some(other) if *other != content => number += 1,
                Some(_) => return name,
                None if name == SCENE => number += 1,
                None => {
                    self.entries.insert(name.clone(), content);
                    return name;
                }
            }
        }
    }

    /// The archive of a scene whose files these are.
    ///
    /// # Errors
    /// If the scene cannot be written.
    pub(super) fn packed(&self, scene: &SceneDescription) -> Result<Vec<u8>, StudioError> {
        let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        archive.start_file(SCENE, stored)?;
        archive.write_all(scene.to_toml()?.as_bytes())?;
        for (name, content) in &self.entries {
            archive.start_file(name.as_str(), stored)?;
            archive.write_all(content)?;
        }
        Ok(archive.finish()?.into_inner())
    }

    /// The scene and the files of an archive.
    ///
    /// # Errors
    /// If it is not an archive, is too large, or its scene names a file that it does not contain.
    pub(super) fn unpacked(archive: &[u8]) -> Result<(SceneDescription, Self), StudioError> {
        let mut archive = ZipArchive::new(Cursor::new(archive)).map_err(|fault| damaged(&fault))?;
        let text = text::decode(entry(&mut archive, SCENE)?);
        let text = text.map_err(|_| StudioError("scene.toml is not UTF-8".to_owned()))?;
        let scene = SceneDescription::parse(&text)?;
        let mut files = Self::default();
        let mut all = 0;
        for path in scene.files() {
            let name = path.to_string_lossy().into_owned();
            if files.entries.contains_key(&name) {
                continue;
            }
            let content = entry(&mut archive, &name)?;
            all += content.len() as u64;
            if all > MAX_BYTES {
                return refused(TOO_LARGE);
            }
            files.entries.insert(name, content);
        }
        Ok((scene, files))
    }

    /// The content of a file.
    ///
    /// # Errors
    /// If the archive lacks it.
    pub(super) fn content(&self, path: &Path) -> Result<&Vec<u8>, StudioError> {
        let name = path.to_string_lossy();
        let content = self.entries.get(name.as_ref());
        content.ok_or_else(|| missing(&name))
    }
}

fn entry(archive: &mut ZipArchive<Cursor<&[u8]>>, name: &str) -> Result<Vec<u8>, StudioError> {
    let found = match archive.by_name(name) {
        Ok(found) => found,
        Err(ZipError::FileNotFound) => return Err(missing(name)),
        Err(fault) => return Err(damaged(&fault)),
    };
    let mut content = Vec::new();
    found
        .take(MAX_BYTES + 1)
        .read_to_end(&mut content)
        .map_err(|fault| damaged(&fault))?;
    if content.len() as u64 > MAX_BYTES {
        refused(TOO_LARGE)
    } else {
        Ok(content)
    }
}

fn missing(name: &str) -> StudioError {
    StudioError(format!(
        "the archive lacks {name}, which its scene.toml names"
    ))
}

fn damaged(fault: &(dyn std::error::Error + 'static)) -> StudioError {
    StudioError::with_cause(
        "this file is not a saved scene: it is not a ZIP archive, or is damaged",
        fault,
    )
}

/// A name that is one on every system, and leads nowhere else.
fn plain_name(name: &str) -> String {
    let last = name.rsplit(['/', '\\']).next().unwrap_or(name);
    let kept = |c: char| c.is_alphanumeric() || ['.', '-', '_'].contains(&c);
    let plain: String = last
        .chars()
        .map(|c| if kept(c) { c } else { '-' })
        .collect();
    plain.trim_start_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_plain_and_none_is_used_twice() {
        let mut files = SceneFiles::default();
        assert_eq!(files.add("../a b.png", vec![1]), "a-b.png");
        assert_eq!(files.add("a b.png", vec![2]), "a-b-2.png");
        assert_eq!(files.add("a b.png", vec![1]), "a-b.png");
        assert_eq!(files.add("scene.toml", vec![1]), "scene-2.toml");
        assert_eq!(files.add("..", vec![3]), ".bin");
    }

    #[test]
    fn what_is_packed_is_unpacked_and_what_is_missing_is_named() {
        let mut files = SceneFiles::default();
        files.add("a.png", vec![7; 20]);
        let scene = |photo: &str| {
            let text = format!("background = \"a.png\"\n[[object]]\nphoto = \"{photo}\"");
            SceneDescription::parse(&text).unwrap()
        };
        let archive = files.packed(&scene("a.png")).unwrap();
        let (back, unpacked) = SceneFiles::unpacked(&archive).unwrap();
        assert_eq!(back, scene("a.png"));
        assert_eq!(unpacked.content(Path::new("a.png")).unwrap(), &vec![7; 20]);
        let lacking = files.packed(&scene("b.png")).unwrap();
        let fault = SceneFiles::unpacked(&lacking).err().unwrap().0;
        assert!(fault.contains("b.png"), "{fault}");
        assert!(SceneFiles::unpacked(b"no archive").is_err());
        for length in (0..archive.len()).step_by(7) {
            assert!(SceneFiles::unpacked(&archive[..length]).is_err());
        }
    }
}
