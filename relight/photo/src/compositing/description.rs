//! A scene as a text in TOML. Names files and opens none.

use std::iter;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use relight_core::image::{Extent, Transfer};
use serde::{Deserialize, Serialize};

use crate::relighting::{
    DiscLamp, InsertError, MaterialChange, ObjectGloss, Placement, WhiteBalance,
};

/// Sides of a picture, pixels.
const SIDES: RangeInclusive<f64> = 16.0..=16_384.0;
/// Brightness, stops.
const STOPS: RangeInclusive<f64> = -20.0..=20.0;
/// The range of angles that may exceed one turn, degrees.
const TURNS: RangeInclusive<f64> = -3600.0..=3600.0;
/// What a channel is multiplied with.
const TINTS: RangeInclusive<f64> = 0.0..=1000.0;
/// The most objects of a scene.
const MAX_OBJECTS: usize = 100;

/// A picture that objects are put into, and all about them.
///
/// ```
/// use relight_photo::compositing::SceneDescription;
///
/// let scene = SceneDescription::parse(r##"
///     background = "room.hdr"
///     light.lamp = "60,30,3200K"
///
///     [[object]]
///     photo = "cup.jpg"
///     mask = "cup-mask.png"
///     at = [0.4, 0.9]
///     height = 0.35
/// "##)?;
/// assert_eq!(scene.objects[0].height, 0.35);
/// assert!(SceneDescription::parse("background = 1").is_err());
/// # Ok::<(), relight_photo::relighting::InsertError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SceneDescription {
    /// A photograph, a panorama or a video.
    pub background: PathBuf,
    /// Width and height of the picture that shows a part of a panorama, pixels.
    #[serde(default = "default_size")]
    pub size: [u32; 2],
    /// How many degrees the picture's longer side shows.
    #[serde(default = "default_fov")]
    pub fov: f64,
    /// How many degrees the camera looks down into a panorama.
    #[serde(default = "default_down")]
    pub down: f64,
    /// The angle at which the camera looks down on the ground of the objects, degrees.
    #[serde(default)]
    pub tilt: Option<f64>,
    /// The light; by default that of the background.
    #[serde(default)]
    pub light: LightDescription,
    /// Whether brightness, white balance and grain of the objects follow the background.
    #[serde(default = "default_true", rename = "match")]
    pub matches: bool,
    /// How the colour of the light is shown.
    #[serde(default)]
    pub white_balance: WhiteBalance,
    /// The brightness of a panorama and its light in stops, from that which is found.
    #[serde(default)]
    pub exposure: f32,
    /// From back to front.
    #[serde(rename = "object")]
    pub objects: Vec<ObjectDescription>,
}

/// The source of the light, at most one of panorama, lamp and coefficients, and its rotation.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LightDescription {
    /// A panorama.
    pub panorama: Option<PathBuf>,
    /// A lamp: `AZIMUTH,ELEVATION[,COLOUR][,SIZE]`.
    pub lamp: Option<String>,
    /// Even light beside the lamp, as a part of it.
    pub ambient: Option<f64>,
    /// A text file of coefficients.
    pub coefficients: Option<PathBuf>,
    /// Degrees by which it is rotated about the vertical, from the viewer to the right, and a panorama behind the objects with
    /// it.
    #[serde(default)]
    pub angle: f64,
}

/// An object of a scene.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectDescription {
    /// Its photograph, or a captured object (`.relit`).
    pub photo: PathBuf,
    /// Its mask in it.
    #[serde(default)]
    pub mask: Option<PathBuf>,
    /// How its integers are encoded, where the file is not to be asked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transfer: Option<Transfer>,
    /// The middle of its lower edge in the picture, in parts of its width and height from the upper left corner.
    #[serde(default = "default_at")]
    pub at: [f64; 2],
    /// Its height in parts of the picture's.
    #[serde(default = "default_height")]
    pub height: f64,
    /// Rotation in the plane, degrees, counter-clockwise.
    #[serde(default)]
    pub rotation: f64,
    /// What its albedo is multiplied with.
    #[serde(default = "default_tint")]
    pub tint: [f32; 3],
    /// The part of even light that it reflects, and its smoothness, in place of the estimated gloss.
    #[serde(default)]
    pub gloss: Option<[f32; 2]>,
    /// Its brightness in stops.
    #[serde(default)]
    pub exposure: f32,
    /// How much of its shadow is seen, 0 to 1.
    #[serde(default = "default_shadow")]
    pub shadow: f32,
}

impl SceneDescription {
    /// Objects before a background, and defaults for everything else.
    pub fn new(background: PathBuf, objects: Vec<ObjectDescription>) -> Self {
        Self {
            background,
            size: default_size(),
            fov: default_fov(),
            down: default_down(),
            tilt: None,
            light: LightDescription::default(),
            matches: default_true(),
            white_balance: WhiteBalance::default(),
            exposure: 0.0,
            objects,
        }
    }

    /// Reads a description, and checks its numbers.
    ///
    /// # Errors
    /// If the text is not TOML, or a value is not allowed.
    pub fn parse(text: &str) -> Result<Self, InsertError> {
        let scene: Self = toml::from_str(text).map_err(|fault| {
            InsertError::Input(format!(
                "it is not a scene: {}",
                fault.to_string().trim_end()
            ))
        })?;
        scene.check()?;
        Ok(scene)
    }

    /// The text of the scene, which [`SceneDescription::parse`] reads back as it was.
    ///
    /// # Errors
    /// If a path is not Unicode.
    pub fn to_toml(&self) -> Result<String, InsertError> {
        toml::to_string(self)
            .map_err(|fault| InsertError::Input(format!("it cannot be written: {fault}")))
    }

    /// The files that it names: background, light, photographs and masks.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        let light = &self.light;
        let lights = [&light.panorama, &light.coefficients];
        let objects = self.objects.iter();
        let objects = objects.flat_map(|object| iter::once(&object.photo).chain(&object.mask));
        iter::once(&self.background)
            .chain(lights.into_iter().flatten())
            .chain(objects)
            .map(PathBuf::as_path)
    }

    /// Width and height of the picture that shows a part of a panorama.
    pub fn panorama_extent(&self) -> Extent {
        let [width, height] = self.size.map(|side| side as usize);
        Extent::new(width, height)
    }

    /// Checks that all values are in range.
    ///
    /// # Errors
    /// [`InsertError`] names the first number that is out of its range; the number of objects comes last.
    pub fn check(&self) -> Result<(), InsertError> {
        let [width, height] = self.size.map(f64::from);
        let tilt = self.tilt.unwrap_or(20.0);
        check_all([
            ("size", width, SIDES, "16 to 16384 pixels"),
            ("size", height, SIDES, "16 to 16384 pixels"),
            ("fov", self.fov, 1.0..=150.0, "1 to 150 degrees"),
            ("down", self.down, -89.0..=89.0, "-89 to 89 degrees"),
            ("tilt", tilt, 0.0..=90.0, "0 to 90 degrees"),
            ("exposure", self.exposure.into(), STOPS, "-20 to 20 stops"),
        ])?;
        self.light.check()?;
        for (number, object) in self.objects.iter().enumerate() {
            object.check(number + 1)?;
        }
        match self.objects.len() {
            1..=MAX_OBJECTS => Ok(()),
            count => Err(InsertError::Objects {
                count,
                most: MAX_OBJECTS,
            }),
        }
    }
}

impl LightDescription {
    /// The lamp, if the light is one.
    ///
    /// # Errors
    /// If its text is none.
    pub fn lamp(&self) -> Result<Option<DiscLamp>, InsertError> {
        let Some(text) = &self.lamp else {
            return Ok(None);
        };
        let lamp: DiscLamp = text
            .parse()
            .map_err(|fault| InsertError::Input(format!("light.lamp: {fault}")))?;
        let ambient = self.ambient.unwrap_or(lamp.ambient);
        Ok(Some(DiscLamp { ambient, ..lamp }))
    }

    fn check(&self) -> Result<(), InsertError> {
        let given: Vec<&'static str> = [
            ("panorama", self.panorama.is_some()),
            ("lamp", self.lamp.is_some()),
            ("coefficients", self.coefficients.is_some()),
        ]
        .into_iter()
        .filter_map(|(name, is_given)| is_given.then_some(name))
        .collect();
        if let [first, second, ..] = given.as_slice() {
            return Err(InsertError::Input(format!(
                "light has both {first} and {second}: give one"
            )));
        }
        let ambient = self.ambient.unwrap_or(0.0);
        check_all([
            ("light.angle", self.angle, TURNS, "-3600 to 3600 degrees"),
            ("light.ambient", ambient, 0.0..=10.0, "0 to 10"),
        ])?;
        self.lamp().map(|_| ())
    }
}

impl ObjectDescription {
    /// The object of a photograph, and all else as a file that does not name it has it.
    pub fn new(photo: PathBuf) -> Self {
        Self {
            photo,
            mask: None,
            transfer: None,
            at: default_at(),
            height: default_height(),
            rotation: 0.0,
            tint: default_tint(),
            gloss: None,
            exposure: 0.0,
            shadow: default_shadow(),
        }
    }

    /// Where it stands.
    pub fn placement(&self) -> Placement {
        Placement {
            at: self.at,
            height: self.height,
            rotation: self.rotation,
        }
    }

    /// What its material becomes.
    pub fn change(&self) -> MaterialChange {
        MaterialChange {
            tint: self.tint,
            gloss: self
                .gloss
                .map(|[part, smoothness]| ObjectGloss::from_part(part, smoothness)),
        }
    }

    fn check(&self, number: usize) -> Result<(), InsertError> {
        let [across, down] = self.at;
        let [red, green, blue] = self.tint.map(f64::from);
        let [part, smoothness] = self.gloss.unwrap_or([0.0, 1.0]).map(f64::from);
        let checked = check_all([
            ("at", across, -0.5..=1.5, "-0.5 to 1.5 across"),
            ("at", down, -0.5..=2.0, "-0.5 to 2 down"),
            ("height", self.height, 0.001..=4.0, "0.001 to 4"),
            ("rotation", self.rotation, TURNS, "-3600 to 3600 degrees"),
            ("exposure", self.exposure.into(), STOPS, "-20 to 20 stops"),
            ("shadow", self.shadow.into(), 0.0..=1.0, "0 to 1"),
            ("tint", red, TINTS, "0 to 1000"),
            ("tint", green, TINTS, "0 to 1000"),
            ("tint", blue, TINTS, "0 to 1000"),
            ("gloss", part, 0.0..=1.0, "a part from 0 to 1"),
            (
                "gloss",
                smoothness,
                0.01..=1000.0,
                "a smoothness from 0.01 to 1000",
            ),
        ]);
        checked.map_err(|fault| InsertError::Input(format!("object {number}: {fault}")))
    }
}

/// Checks that each number, with its name, lies in its range, also given in words. NaN lies in no range.
fn check_all<const N: usize>(
    numbers: [(&str, f64, RangeInclusive<f64>, &str); N],
) -> Result<(), InsertError> {
    for (what, value, range, allowed) in numbers {
        if !range.contains(&value) {
            return Err(InsertError::Input(format!(
                "{what} is {value}: it has to be {allowed}"
            )));
        }
    }
    Ok(())
}

fn default_size() -> [u32; 2] {
    [1280, 960]
}

fn default_fov() -> f64 {
    60.0
}

fn default_down() -> f64 {
    10.0
}

fn default_true() -> bool {
    true
}

fn default_at() -> [f64; 2] {
    [0.5, 0.9]
}

fn default_height() -> f64 {
    0.4
}

fn default_tint() -> [f32; 3] {
    [1.0; 3]
}

fn default_shadow() -> f32 {
    1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(more: &str) -> String {
        let text = format!("background = \"a.jpg\"\n{more}\n");
        SceneDescription::parse(&text).unwrap_err().to_string()
    }

    #[test]
    fn what_is_not_said_has_a_default() {
        let scene =
            SceneDescription::parse("background = \"a.hdr\"\n[[object]]\nphoto = \"b.jpg\"")
                .unwrap();
        assert_eq!(scene.objects[0].at, [0.5, 0.9]);
        assert_eq!(scene.objects[0].change(), MaterialChange::default());
        assert_eq!(scene.objects[0].transfer, None);
        let linear = "background = \"a.hdr\"\n[[object]]\nphoto = \"b.png\"\ntransfer = \"linear\"";
        let linear = SceneDescription::parse(linear).unwrap();
        assert_eq!(linear.objects[0].transfer, Some(Transfer::Linear));
        assert!(scene.matches && scene.light == LightDescription::default());
    }

    #[test]
    fn a_scene_that_is_written_is_read_back() {
        let text = r#"
            background = "room.exr"
            white_balance = "auto"
            light = { lamp = "60,30,3200K", ambient = 0.2, angle = -40.5 }

            [[object]]
            photo = "cup.png"
            mask = "cup-mask.png"
            transfer = "gamma22"
            at = [0.25, 0.75]
            gloss = [0.3, 40.0]
        "#;
        let scene = SceneDescription::parse(text).unwrap();
        assert_eq!(scene.light.angle, -40.5);
        let written = scene.to_toml().unwrap();
        assert_eq!(SceneDescription::parse(&written).unwrap(), scene);
    }

    #[test]
    fn what_cannot_be_is_named() {
        let object = "[[object]]\nphoto = \"b.jpg\"\n";
        assert!(fault("").contains("`object`"));
        assert!(fault("object = []").contains("0 objects"));
        assert!(fault(&format!("fvo = 3\n{object}")).contains("`fvo`"));
        assert!(fault(&format!("fov = nan\n{object}")).contains("NaN"));
        assert!(fault(&format!("size = [1, 1]\n{object}")).contains("size is 1"));
        assert!(fault(&format!("light = {{ lamp = \"1\" }}\n{object}")).contains("light.lamp"));
        assert!(fault(&format!("light = {{ angle = inf }}\n{object}")).contains("light.angle"));
        let both = "light = { lamp = \"1,2\", panorama = \"c.hdr\" }";
        assert!(fault(&format!("{both}\n{object}")).contains("panorama"));
        assert!(fault(&format!("{object}height = 0")).contains("height"));
        assert!(fault(&format!("{object}gloss = [2, 5]")).contains("gloss"));
        assert!(fault(&format!("{object}shadow = -1")).contains("shadow"));
        assert!(fault(&format!("{object}transfer = \"log\"")).contains("`log`"));
        assert!(fault("= 3").contains("line 2"));
    }
}
