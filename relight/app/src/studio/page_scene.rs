//! The scene as the page has it, to and from the scene of a file.

use std::path::PathBuf;

use relight_core::image::Transfer;
use relight_photo::compositing::{LightDescription, ObjectDescription, SceneDescription};
use relight_photo::relighting::{DiscLamp, InsertError};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::error::{StudioError, refused};

/// A scene as a file has it, but that its objects are numbers, its background is the engine's, and its lamp is in parts.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
pub(super) struct PageScene {
    light: PageLight,
    pub(super) objects: Vec<PageObject>,
    #[serde(flatten)]
    rest: Map<String, Value>,
}

/// The light of a scene.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
struct PageLight {
    kind: LightKind,
    azimuth: f64,
    elevation: f64,
    /// As `relight insert --lamp` takes it.
    colour: String,
    size: f64,
    ambient: f64,
    angle: f64,
}

/// Where the light comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
enum LightKind {
    /// From the background.
    Background,
    /// From a lamp.
    Lamp,
}

/// An object of a scene, as a file has it, but for its files.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
pub(super) struct PageObject {
    pub(super) object: u32,
    #[serde(flatten)]
    rest: Map<String, Value>,
}

/// The files of an object.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct ObjectFiles {
    pub(super) photo: PathBuf,
    pub(super) mask: Option<PathBuf>,
    pub(super) transfer: Option<Transfer>,
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
        scene.light = self.light.described();
        for (object, files) in scene.objects.iter_mut().zip(files) {
            (object.photo, object.mask) = (files.photo, files.mask);
            object.transfer = files.transfer;
        }
        match scene.check() {
            // A background alone is a picture too.
            Ok(()) | Err(InsertError::Objects { count: 0, .. }) => Ok(scene),
            Err(fault) => Err(fault.into()),
        }
    }

    /// The page's scene of a file's, whose objects have these numbers.
    ///
    /// # Errors
    /// If its light is one that the page has not.
    pub(super) fn new(scene: &SceneDescription, numbers: &[u32]) -> Result<Self, StudioError> {
        let objects = scene.objects.iter().zip(numbers);
        let mut rest = fields(scene)?;
        rest.retain(|name, _| !["background", "light", "object"].contains(&name.as_str()));
        Ok(Self {
            rest,
            light: PageLight::new(&scene.light)?,
            objects: objects
                .map(|(object, &number)| PageObject::new(object, number))
                .collect::<Result<_, _>>()?,
        })
    }
}

/// The fields of what has fields, as JSON.
fn fields(of: &impl Serialize) -> Result<Map<String, Value>, StudioError> {
    match serde_json::to_value(of)? {
        Value::Object(fields) => Ok(fields),
        other => refused(format!("{other} has no fields")),
    }
}

impl PageObject {
    fn new(object: &ObjectDescription, number: u32) -> Result<Self, StudioError> {
        let mut rest = fields(object)?;
        rest.retain(|name, _| !["photo", "mask", "transfer"].contains(&name.as_str()));
        Ok(Self {
            object: number,
            rest,
        })
    }
}

impl PageLight {
    fn described(&self) -> LightDescription {
        let Self {
            azimuth,
            elevation,
            colour,
            size,
            ..
        } = self;
        let is_lamp = self.kind == LightKind::Lamp;
        LightDescription {
            lamp: is_lamp.then(|| format!("{azimuth},{elevation},{colour},{size}")),
            ambient: is_lamp.then_some(self.ambient),
            angle: self.angle,
            ..LightDescription::default()
        }
    }

    fn new(light: &LightDescription) -> Result<Self, StudioError> {
        if light.panorama.is_some() || light.coefficients.is_some() {
            return refused(
                "the page cannot open a scene with light from a file: use relight insert",
            );
        }
        let found = light.lamp()?;
        let lamp = found.unwrap_or_default();
        let colour = light.lamp.as_deref().and_then(colour_of);
        Ok(Self {
            kind: if found.is_some() {
                LightKind::Lamp
            } else {
                LightKind::Background
            },
            azimuth: lamp.azimuth,
            elevation: lamp.elevation,
            colour: colour.unwrap_or("#ffffff").to_owned(),
            size: lamp.size,
            ambient: found.map_or(DiscLamp::default().ambient, |lamp| lamp.ambient),
            angle: light.angle,
        })
    }
}

/// The colour in the text of a lamp: the part after the angles that is not a number.
fn colour_of(lamp: &str) -> Option<&str> {
    let mut parts = lamp.split(',').skip(2).map(str::trim);
    parts.find(|part| part.parse::<f64>().is_err())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(light: &str) -> SceneDescription {
        let text = format!(
            "background = \"a.jpg\"\nlight = {{ {light} }}\n[[object]]\nphoto = \"b.png\"\nat = [0.25, 0.5]"
        );
        SceneDescription::parse(&text).unwrap()
    }

    #[test]
    fn a_scene_comes_back_from_the_page_as_it_was() {
        for light in [
            "",
            "angle = 30.0",
            "lamp = \"60,-30,#ff8000,12\", ambient = 0.4",
            "lamp = \"-20,10,3200K,30\", ambient = 0.15, angle = -5.5",
        ] {
            let scene = parsed(light);
            let page = PageScene::new(&scene, &[7]).unwrap();
            assert_eq!(page.objects[0].object, 7);
            let files = ObjectFiles {
                photo: "b.png".into(),
                ..ObjectFiles::default()
            };
            let back = page.described("a.jpg".into(), vec![files]).unwrap();
            assert_eq!(back, scene, "{light}");
        }
    }

    #[test]
    fn a_lamp_without_colour_is_white() {
        let page = PageScene::new(&parsed("lamp = \"60,30\""), &[1]).unwrap();
        assert_eq!(page.light.colour, "#ffffff");
        let warm = PageScene::new(&parsed("lamp = \"60, 30, 10, 3200K\""), &[1]).unwrap();
        assert_eq!(
            (warm.light.colour.as_str(), warm.light.size),
            ("3200K", 10.0)
        );
    }

    #[test]
    fn light_that_the_page_has_not_is_refused_by_name() {
        let refused = |light: &str| PageScene::new(&parsed(light), &[1]).unwrap_err().0;
        let file = refused("panorama = \"c.hdr\"");
        assert!(file.contains("file"), "{file}");
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        let mut page = PageScene::new(&parsed(""), &[1]).unwrap();
        page.rest.insert("fov".to_owned(), 1e9.into());
        let described = page.described("a.jpg".into(), vec![ObjectFiles::default()]);
        assert!(described.is_err());
    }
}
