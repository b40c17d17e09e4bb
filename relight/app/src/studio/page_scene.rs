//! The scene as the page has it: that of a file, but that its objects are numbers, and its background is the engine's.

use std::path::PathBuf;

use relight_photo::compositing::SceneDescription;
use relight_photo::relighting::InsertError;
use serde::Deserialize;
use serde_json::{Map, Value};

use super::error::StudioError;

/// A scene.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct PageScene {
    pub(super) objects: Vec<PageObject>,
    #[serde(flatten)]
    rest: Map<String, Value>,
}

/// An object of a scene, as a file has it, but for its files.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct PageObject {
    pub(super) object: u32,
    #[serde(flatten)]
    rest: Map<String, Value>,
}

/// The files of an object.
#[derive(Debug, Clone, Default)]
pub(super) struct ObjectFiles {
    pub(super) photo: PathBuf,
    pub(super) mask: Option<PathBuf>,
}

impl PageScene {
    /// The scene as a file has it, with the files of its background and of each object.
    ///
    /// # Errors
    /// If something is missing or unknown, or a number is out of its range.
    pub(super) fn described(
        &self,
        background: PathBuf,
        files: Vec<ObjectFiles>,
    ) -> Result<SceneDescription, StudioError> {
        let objects = self.objects.iter().map(|object| {
            let mut described = object.rest.clone();
            described.insert("photo".to_owned(), "".into());
            described
        });
        let objects: Vec<_> = objects.collect();
        let mut scene = self.rest.clone();
        scene.insert("background".to_owned(), "".into());
        scene.insert("object".to_owned(), objects.into());
        let mut scene: SceneDescription = serde_json::from_value(scene.into())?;
        scene.background = background;
        for (object, files) in scene.objects.iter_mut().zip(files) {
            (object.photo, object.mask) = (files.photo, files.mask);
        }
        match scene.check() {
            // A background alone is a picture too.
            Ok(()) | Err(InsertError::Objects { count: 0, .. }) => Ok(scene),
            Err(fault) => Err(fault.into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn numbers_out_of_range_and_unknown_fields_are_refused() {
        let described = |more: Value| {
            let mut scene = json!({ "light": {}, "objects": [{ "object": 7, "at": [0.5, 0.9], "height": 0.4 }] });
            scene
                .as_object_mut()
                .unwrap()
                .extend(more.as_object().unwrap().clone());
            let scene: PageScene = serde_json::from_value(scene).unwrap();
            scene.described("a.jpg".into(), vec![ObjectFiles::default()])
        };
        assert!(described(json!({ "fov": 50.0 })).is_ok());
        assert!(described(json!({ "fov": 1e9 })).is_err());
        assert!(described(json!({ "field": 50.0 })).is_err());
    }
}
