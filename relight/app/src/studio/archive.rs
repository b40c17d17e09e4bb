//! A scene with all that it needs in one ZIP archive: `scene.toml` as `relight insert --scene` reads it, photographs, masks and
//! the background. Entries are stored without compression.

use std::collections::BTreeMap;
use std::io::{Cursor, Write};
use std::path::PathBuf;

use relight_photo::compositing::SceneDescription;
use relit_grabcut::grey_png;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::background::StudioBackground;
use super::error::StudioError;
use super::object::{StudioObject, stem};
use super::page_scene::ObjectFiles;

/// The description's entry.
const SCENE: &str = "scene.toml";

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
        })
    }

    /// Adds the background's file; its name.
    pub(super) fn add_background(&mut self, background: &StudioBackground) -> PathBuf {
        self.add(&background.name, background.file().to_vec())
            .into()
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
}
