//! What a background says of the objects that are put before it: their light, how far their ground is looked down on, and
//! how bright they are. Opens no files.

use std::f32::consts::PI;

use relight_core::image::{Extent, Linear, Rgb};
use relight_core::light::Panorama;
use relight_core::render::exposure_for;

use super::placement::rows;
use super::{
    InsertError, InsertScene, LightSource, Matching, ObjectDescription, PanoramaView,
    SceneDescription, SceneObject,
};
use crate::decompose::Photo;

/// The part of the brightest light that a white diffuse surface has in a picture of a panorama: bright places clip, as in
/// photographs.
const WHITE: f32 = 1.4;
/// Photographs are brought to this much more than the size in which they are shown.
const RESERVE: f64 = 1.25;
/// The shortest that the longest side of a photograph is made, pixels.
const SHORTEST: usize = 32;
/// Ground that is looked down on in a photograph, degrees.
const TILT: f64 = 20.0;
/// The least and the most of a panorama's, degrees.
const TILTS: (f64, f64) = (5.0, 89.0);

/// A background that stands still.
#[derive(Debug, Clone, Copy)]
pub enum SceneBackground<'a> {
    /// A photograph, or the first frame of a video.
    Picture(&'a Rgb<Linear>),
    /// A panorama, of which a part is seen.
    Panorama(&'a Panorama),
}

/// What follows from a scene's description and its background, before the objects are known.
#[derive(Debug, Clone)]
pub struct SceneSetting {
    /// Width and height of the picture.
    pub extent: Extent,
    /// The light: the one that is given, or that of the background.
    pub light: LightSource,
    /// How far the camera looks down on the ground of the objects, degrees.
    pub tilt: f64,
    /// What the background asks of the objects.
    pub matching: Matching,
    /// What a panorama's radiance is multiplied with to be shown.
    panorama_scale: f32,
}

impl SceneSetting {
    /// The setting of a scene before a background. Light that is not `given` is taken from the background.
    ///
    /// # Errors
    /// [`InsertError::Dark`] where there is no light.
    pub fn new(
        scene: &SceneDescription,
        background: SceneBackground<'_>,
        given: Option<LightSource>,
    ) -> Result<Self, InsertError> {
        let mut matching = match background {
            SceneBackground::Picture(picture) if scene.matches => Matching::of(picture),
            _ => Matching::default(),
        };
        if given.is_none() {
            // Light that was taken from the background has its colour.
            matching.balance = [1.0; 3];
        }
        let light = given.unwrap_or_else(|| match background {
            SceneBackground::Panorama(panorama) => LightSource::Panorama(panorama.clone()),
            SceneBackground::Picture(picture) => LightSource::of_picture(picture, scene.field),
        });
        let panorama_scale = exposure_for(&light.light()?) * WHITE * PI * scene.exposure.exp2();
        if let SceneBackground::Panorama(_) = background {
            matching.level = scene.exposure.exp2();
        }
        let extent = match background {
            SceneBackground::Panorama(_) => scene.panorama_extent(),
            SceneBackground::Picture(picture) => picture.planes().extent(),
        };
        Ok(Self {
            extent,
            light,
            tilt: scene.tilt.unwrap_or_else(|| tilt_of(scene, background)),
            matching,
            panorama_scale,
        })
    }

    /// The photograph of an object no larger than it has to be for its size in the scene.
    #[must_use]
    pub fn reduced(&self, object: &ObjectDescription, photo: Photo) -> Photo {
        let wanted = object.height * self.extent.height as f64 * RESERVE;
        let Extent { width, height } = photo.picture.planes().extent();
        let own = rows(&photo.mask).len().max(1) as f64;
        let longest = (width.max(height) as f64 * wanted / own).ceil() as usize;
        photo.at_most(longest.max(SHORTEST))
    }

    /// The objects in this setting, from back to front.
    ///
    /// # Errors
    /// As [`InsertScene::new`].
    pub fn scene<'a>(&self, objects: Vec<SceneObject<'a>>) -> Result<InsertScene<'a>, InsertError> {
        InsertScene::new(self.extent, &self.light, self.tilt, self.matching, objects)
    }

    /// What is seen of a panorama that has turned by so many radians, as bright as it is shown.
    #[must_use]
    pub fn seen(&self, view: &PanoramaView, panorama: &Panorama, turn: f64) -> Rgb<Linear> {
        let seen = view.picture(panorama, turn).into_planes();
        Rgb::new(seen.map(|v| v.max(0.0) * self.panorama_scale))
    }
}

/// How far the camera looks down on the ground of the first object, degrees.
fn tilt_of(scene: &SceneDescription, background: SceneBackground<'_>) -> f64 {
    let (SceneBackground::Panorama(_), Some(object)) = (background, scene.objects.first()) else {
        return TILT;
    };
    let [width, height] = scene.size.map(f64::from);
    let tangent = (scene.field / 2.0).to_radians().tan();
    let below = (object.at[1] - 0.5) * height * 2.0 * tangent / width.max(height);
    (scene.down + below.atan().to_degrees()).clamp(TILTS.0, TILTS.1)
}

#[cfg(test)]
mod tests {
    use relight_core::image::Planes;
    use relight_core::light::{Order, ShLight};

    use super::*;
    use crate::insert::DiscLamp;

    fn described(more: &str) -> SceneDescription {
        let text = format!("background = \"a.hdr\"\n{more}\n[[object]]\nphoto = \"b.jpg\"");
        SceneDescription::parse(&text).unwrap()
    }

    fn sky() -> Panorama {
        let even = ShLight::even(Order::TWO, [0.2, 0.4, 1.0]);
        Panorama::of_light(&even, Extent::new(32, 16))
    }

    fn dusk() -> Rgb<Linear> {
        Rgb::new(Planes::from_fn(Extent::new(64, 48), |x, _| {
            [0.3, 0.2, 0.1].map(|v| v * x as f32 / 64.0)
        }))
    }

    #[test]
    fn a_panorama_lights_its_objects_and_is_seen_as_bright_as_it_lights_them() {
        let panorama = sky();
        let background = SceneBackground::Panorama(&panorama);
        let scene = described("size = [200, 100]");
        let plain = SceneSetting::new(&scene, background, None).unwrap();
        assert_eq!(plain.extent, Extent::new(200, 100));
        assert_eq!(plain.light, LightSource::Panorama(panorama.clone()));
        assert_eq!(plain.matching, Matching::default());
        let view = PanoramaView::new(plain.extent, scene.field, scene.down);
        let shown = |setting: &SceneSetting| {
            let seen = setting.seen(&view, &panorama, 0.0);
            seen.planes().pixel(100, 50)[1]
        };
        let brighter = described("size = [200, 100]\nexposure = 1.0");
        let brighter = SceneSetting::new(&brighter, background, None).unwrap();
        assert_eq!(brighter.matching.level, 2.0);
        assert!((shown(&brighter) / shown(&plain) - 2.0).abs() < 1e-5);
    }

    #[test]
    fn a_picture_is_followed_in_brightness_and_only_given_light_in_colour() {
        let (picture, scene) = (dusk(), described(""));
        let background = SceneBackground::Picture(&picture);
        let taken = SceneSetting::new(&scene, background, None).unwrap();
        assert_eq!(taken.extent, Extent::new(64, 48));
        assert!(taken.matching.level < 0.5 && taken.matching.balance == [1.0; 3]);
        let lamp = LightSource::Lamp(DiscLamp::default());
        let given = SceneSetting::new(&scene, background, Some(lamp.clone())).unwrap();
        assert_eq!(given.light, lamp);
        assert!(given.matching.balance[0] > given.matching.balance[2]);
        let unmatched = SceneSetting::new(&described("match = false"), background, Some(lamp));
        assert_eq!(unmatched.unwrap().matching, Matching::default());
    }

    #[test]
    fn the_ground_is_looked_down_on_as_far_as_the_camera_sees_it() {
        let panorama = sky();
        let tilt = |more: &str, background| {
            let setting = SceneSetting::new(&described(more), background, None);
            setting.unwrap().tilt
        };
        let around = SceneBackground::Panorama(&panorama);
        // The object stands at 0.9 of the height: 0.4 x 960 / 1280 x 2 tan 30° below the middle, after 10° down.
        let expected = 10.0
            + (0.4 * 0.75 * 2.0 * 30_f64.to_radians().tan())
                .atan()
                .to_degrees();
        assert!((tilt("", around) - expected).abs() < 1e-9);
        assert_eq!(tilt("down = -80.0", around), 5.0);
        assert_eq!(tilt("tilt = 33.0", around), 33.0);
        assert_eq!(tilt("", SceneBackground::Picture(&dusk())), 20.0);
    }

    #[test]
    fn light_that_is_none_is_refused() {
        let black = Panorama::of_light(&ShLight::dark(Order::TWO), Extent::new(32, 16));
        let refused = SceneSetting::new(&described(""), SceneBackground::Panorama(&black), None);
        assert!(matches!(refused, Err(InsertError::Dark)));
    }

    #[test]
    fn a_photograph_is_brought_to_the_size_in_which_its_object_is_shown() {
        let extent = Extent::new(400, 300);
        let picture = Rgb::new(Planes::filled(extent, [0.5; 3]));
        // The object is 150 rows high, and shown in half of 48 rows.
        let mask = Planes::from_fn(extent, |_, y| {
            [f32::from(u8::from((100..250).contains(&y)))]
        });
        let photo = Photo::of_frame("a".into(), picture, mask, None).unwrap();
        let background = dusk();
        let setting =
            SceneSetting::new(&described(""), SceneBackground::Picture(&background), None);
        let object = ObjectDescription {
            height: 0.5,
            ..described("").objects[0].clone()
        };
        let reduced = setting.unwrap().reduced(&object, photo);
        // 400 x 0.5 x 48 x 1.25 / 150 pixels.
        assert_eq!(reduced.picture.planes().extent(), Extent::new(80, 60));
        assert_eq!(rows(&reduced.mask).len(), 30);
    }
}
