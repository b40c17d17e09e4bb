//! The scene as the page has it, to and from the scene of a file.

use std::path::PathBuf;

use relight_photo::insert::{
    DiscLamp, LightDescription, ObjectDescription, SceneDescription, SceneFault, WhiteBalance,
};
use serde::{Deserialize, Serialize};

use super::StudioError;

/// A scene, whose objects are numbers and whose background is the engine's.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
pub(super) struct PageScene {
    pub(super) size: [u32; 2],
    pub(super) field: f64,
    pub(super) down: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) tilt: Option<f64>,
    #[serde(rename = "match")]
    pub(super) matches: bool,
    pub(super) white_balance: WhiteBalance,
    pub(super) exposure: f32,
    pub(super) light: PageLight,
    pub(super) objects: Vec<PageObject>,
}

/// The light of a scene.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
pub(super) struct PageLight {
    pub(super) kind: LightKind,
    pub(super) azimuth: f64,
    pub(super) elevation: f64,
    /// As `relight insert --lamp` takes it.
    pub(super) colour: String,
    pub(super) size: f64,
    pub(super) ambient: f64,
    pub(super) turn: f64,
}

/// Where the light comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum LightKind {
    /// From the background.
    Background,
    /// From a lamp.
    Lamp,
}

/// An object of a scene.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
pub(super) struct PageObject {
    pub(super) object: u32,
    pub(super) at: [f64; 2],
    pub(super) height: f64,
    pub(super) rotation: f64,
    pub(super) tint: [f32; 3],
    #[serde(default)]
    pub(super) gloss: Option<[f32; 2]>,
    pub(super) exposure: f32,
    pub(super) shadow: f32,
}

/// The files of an object.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct ObjectFiles {
    pub(super) photo: PathBuf,
    pub(super) mask: Option<PathBuf>,
    pub(super) transfer: Option<relight_core::image::Transfer>,
}

impl PageScene {
    /// The scene as a file has it, with the files of its background and of each object.
    ///
    /// # Errors
    /// Where a number is out of its range.
    pub(super) fn described(
        &self,
        background: PathBuf,
        files: Vec<ObjectFiles>,
    ) -> Result<SceneDescription, StudioError> {
        let pairs = self.objects.iter().zip(files);
        let scene = SceneDescription {
            background,
            size: self.size,
            field: self.field,
            down: self.down,
            tilt: self.tilt,
            light: self.light.described(),
            matches: self.matches,
            white_balance: self.white_balance,
            exposure: self.exposure,
            objects: pairs
                .map(|(object, files)| object.described(files))
                .collect(),
        };
        match scene.check() {
            // A background alone is a picture too.
            Ok(()) | Err(SceneFault::Objects(0)) => Ok(scene),
            Err(fault) => Err(fault.into()),
        }
    }

    /// The page's scene of a file's, whose objects have these numbers.
    ///
    /// # Errors
    /// Where its light is one that the page has not.
    pub(super) fn of(scene: &SceneDescription, numbers: &[u32]) -> Result<Self, StudioError> {
        let objects = scene.objects.iter().zip(numbers);
        Ok(Self {
            size: scene.size,
            field: scene.field,
            down: scene.down,
            tilt: scene.tilt,
            matches: scene.matches,
            white_balance: scene.white_balance,
            exposure: scene.exposure,
            light: PageLight::of(&scene.light)?,
            objects: objects
                .map(|(object, &number)| PageObject::of(object, number))
                .collect(),
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
            turn: self.turn,
            ..LightDescription::default()
        }
    }

    fn of(light: &LightDescription) -> Result<Self, StudioError> {
        if light.panorama.is_some() || light.coefficients.is_some() {
            return Err(StudioError::Unsupported("light from a file of its own"));
        }
        if light.object.is_some() {
            return Err(StudioError::Unsupported(
                "light from an object of the background",
            ));
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
            turn: light.turn,
        })
    }
}

/// The colour in the text of a lamp: what is no number behind its angles.
fn colour_of(lamp: &str) -> Option<&str> {
    let mut parts = lamp.split(',').skip(2).map(str::trim);
    parts.find(|part| part.parse::<f64>().is_err())
}

impl PageObject {
    fn described(&self, files: ObjectFiles) -> ObjectDescription {
        ObjectDescription {
            photo: files.photo,
            mask: files.mask,
            transfer: files.transfer,
            at: self.at,
            height: self.height,
            rotation: self.rotation,
            tint: self.tint,
            gloss: self.gloss,
            exposure: self.exposure,
            shadow: self.shadow,
        }
    }

    fn of(object: &ObjectDescription, number: u32) -> Self {
        Self {
            object: number,
            at: object.at,
            height: object.height,
            rotation: object.rotation,
            tint: object.tint,
            gloss: object.gloss,
            exposure: object.exposure,
            shadow: object.shadow,
        }
    }
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
            "turn = 30.0",
            "lamp = \"60,-30,#ff8000,12\", ambient = 0.4",
            "lamp = \"-20,10,3200K,30\", ambient = 0.15, turn = -5.5",
        ] {
            let scene = parsed(light);
            let page = PageScene::of(&scene, &[7]).unwrap();
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
        let page = PageScene::of(&parsed("lamp = \"60,30\""), &[1]).unwrap();
        assert_eq!(page.light.colour, "#ffffff");
        let warm = PageScene::of(&parsed("lamp = \"60, 30, 10, 3200K\""), &[1]).unwrap();
        assert_eq!(
            (warm.light.colour.as_str(), warm.light.size),
            ("3200K", 10.0)
        );
    }

    #[test]
    fn light_that_the_page_has_not_is_refused_by_name() {
        let refused = |light: &str| {
            let fault = PageScene::of(&parsed(light), &[1]).unwrap_err();
            fault.to_string()
        };
        assert!(refused("panorama = \"c.hdr\"").contains("a file of its own"));
        assert!(refused("object = \"m.png\"").contains("object of the background"));
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        let mut page = PageScene::of(&parsed(""), &[1]).unwrap();
        page.field = f64::NAN;
        let fault = page.described("a.jpg".into(), vec![ObjectFiles::default()]);
        assert!(matches!(fault, Err(StudioError::Scene(_))));
    }
}
