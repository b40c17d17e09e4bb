//! What a background determines for inserted objects: their light, the tilt of their ground, and
//! how bright they are. Opens no files.

use std::f32::consts::PI;

use relight_core::image::{Extent, Linear, Rgb};
use relight_core::light::{Panorama, ShLight};
use relight_core::render::exposure_for;

use super::{Harmonisation, InsertScene, ObjectDescription, SceneDescription, SceneObject};
use crate::decompose::Photo;
use crate::relighting::{
    InsertError, LightSource, PanoramaExposure, PanoramaView, SeenSun, WHITE, WhiteBalance, rows,
};

/// The size of a panorama from which shadows are drawn, at most.
const MAX_AROUND: Extent = Extent::new(512, 256);
/// The longer side of a panorama's picture for its exposure, pixels.
const LOOK: usize = 160;
/// Photographs are resized to this multiple of their displayed size.
const RESERVE: f64 = 1.25;
/// The shortest that the longest side of a photograph is made, pixels.
const MIN_SIDE: usize = 32;
/// Ground that is looked down on in a photograph, degrees.
const TILT: f64 = 20.0;
/// The least and the most of a panorama's, degrees.
const TILTS: (f64, f64) = (5.0, 89.0);

/// A background that stands still.
#[derive(Debug, Clone, Copy)]
pub enum SceneBackground<'a> {
    /// A photograph, or the first frame of a video.
    Picture(&'a Rgb<Linear>),
    /// A panorama; the background shows part of it.
    Panorama(&'a Panorama),
}

/// The setting of a scene: what follows from its description and background, before the objects.
#[derive(Debug, Clone)]
pub struct SceneEnvironment {
    /// Width and height of the picture.
    pub extent: Extent,
    /// The light: the given one, or that of the background.
    pub light: LightSource,
    /// How far the camera looks down on the ground of the objects, degrees.
    pub tilt: f64,
    /// What the background asks of the objects.
    pub harmonisation: Harmonisation,
    /// The sun in a picture that gives the light.
    pub sun: Option<SeenSun>,
    /// Whether the light is estimated from a picture.
    pub is_estimated: bool,
    /// How a panorama is exposed.
    pub exposure: Option<PanoramaExposure>,
    /// The light as coefficients.
    projected: ShLight,
    /// The same as a panorama, from which shadows are drawn.
    around: Panorama,
    /// Whether objects are lit by the panorama that is seen, so that one exposure holds for both.
    is_one_light: bool,
    /// What a panorama's radiance is multiplied with to be shown.
    panorama_scale: [f32; 3],
}

impl SceneEnvironment {
    /// The setting of a scene before a background. Light that is not `given` is taken from the background.
    ///
    /// # Errors
    /// If the light is dark.
    pub fn new(
        scene: &SceneDescription,
        background: SceneBackground<'_>,
        given: Option<LightSource>,
    ) -> Result<Self, InsertError> {
        let mut harmonisation = match background {
            SceneBackground::Picture(picture) if scene.matches => {
                Harmonisation::from_background(picture)
            }
            _ => Harmonisation::default(),
        };
        if given.is_none() {
            // Light that was taken from the background has its colour.
            harmonisation.balance = [1.0; 3];
        }
        if scene.white_balance == WhiteBalance::Auto
            && let SceneBackground::Picture(picture) = background
        {
            harmonisation.balance = Harmonisation::from_background(picture).balance;
        }
        let is_estimated = given.is_none() && matches!(background, SceneBackground::Picture(_));
        let sun = match background {
            SceneBackground::Picture(picture) if is_estimated => SeenSun::find(picture.planes()),
            _ => None,
        };
        let light = given.unwrap_or_else(|| match background {
            SceneBackground::Panorama(panorama) => LightSource::Panorama(panorama.clone()),
            SceneBackground::Picture(picture) => LightSource::from_picture(picture, scene.fov, sun),
        });
        let coefficients = light.light()?;
        // A panorama behind objects is not seen by an eye that adapts to their lamp.
        let tint = match scene.white_balance {
            WhiteBalance::Auto => scene.white_balance.tint(&coefficients),
            WhiteBalance::Adapted | WhiteBalance::Light => [1.0; 3],
        };
        // The colour of a picture is that of its light and of what it shows: its cast is limited as a lamp's is.
        let shown = if is_estimated {
            let tint = scene.white_balance.tint(&coefficients);
            light.clone().tinted(tint)?
        } else {
            scene.white_balance.shown(light.clone())?
        };
        let projected = if shown == light {
            coefficients.clone()
        } else {
            shown.light()?
        };
        let light = shown;
        let around = for_shadows(light.panorama());
        let base = exposure_for(&coefficients.clone().tinted(tint)) * WHITE * PI;
        let mut panorama_scale = tint.map(|t| t as f32 * base);
        let (mut exposure, mut is_one_light) = (None, false);
        if let SceneBackground::Panorama(panorama) = background {
            // A lamp's strength and a panorama's are told in other units: each is exposed by itself.
            is_one_light = matches!(light, LightSource::Panorama(_));
            let bound = is_one_light.then_some(&coefficients);
            let found = exposed(scene, panorama, panorama_scale, bound);
            let gain = found.stops.exp2();
            harmonisation.level = if is_one_light && scene.matches {
                WHITE * gain
            } else if is_one_light {
                gain
            } else {
                scene.exposure.exp2()
            };
            panorama_scale = panorama_scale.map(|scale| scale * gain);
            exposure = Some(found);
        }
        let extent = match background {
            SceneBackground::Panorama(_) => scene.panorama_extent(),
            SceneBackground::Picture(picture) => picture.planes().extent(),
        };
        Ok(Self {
            extent,
            light,
            tilt: Self::ground_tilt(scene, background),
            harmonisation,
            sun,
            is_estimated,
            exposure,
            is_one_light,
            projected,
            around,
            panorama_scale,
        })
    }

    /// How far the camera of a scene looks down on the ground of its objects, degrees: as far as it is given, or as the first
    /// object's place says.
    pub fn ground_tilt(scene: &SceneDescription, background: SceneBackground<'_>) -> f64 {
        if let Some(tilt) = scene.tilt {
            return tilt;
        }
        let (SceneBackground::Panorama(_), Some(object)) = (background, scene.objects.first())
        else {
            return TILT;
        };
        let [width, height] = scene.size.map(f64::from);
        let tangent = (scene.fov / 2.0).to_radians().tan();
        let below = (object.at[1] - 0.5) * height * 2.0 * tangent / width.max(height);
        (scene.down + below.atan().to_degrees()).clamp(TILTS.0, TILTS.1)
    }

    /// The photograph of an object no larger than it has to be for its size in the scene.
    pub fn downscaled(&self, object: &ObjectDescription, photo: Photo) -> Photo {
        let wanted = object.height * self.extent.height as f64 * RESERVE;
        let Extent { width, height } = photo.picture.planes().extent();
        let own = rows(&photo.mask).len().max(1) as f64;
        let longest = (width.max(height) as f64 * wanted / own).ceil() as usize;
        photo.at_most(longest.max(MIN_SIDE))
    }

    /// The objects in this setting, from back to front.
    ///
    /// # Errors
    /// Whatever is wrong with an object or the background.
    pub fn scene<'a>(&self, objects: Vec<SceneObject<'a>>) -> Result<InsertScene<'a>, InsertError> {
        let light = (self.projected.clone(), self.around.clone());
        let scene = InsertScene::new(self.extent, light, self.tilt, self.harmonisation, objects)?;
        Ok(if self.is_one_light && self.harmonisation.level != 1.0 {
            scene.with_brightness_of_light()
        } else {
            scene
        })
    }

    /// The visible part of a panorama that has rotated by so many radians, at its exposure.
    pub fn seen(&self, view: &PanoramaView, panorama: &Panorama, turn: f64) -> Rgb<Linear> {
        view.exposed(panorama, turn, self.panorama_scale)
    }
}

/// A panorama no larger than shadows need it: it is turned and looked at again and again.
fn for_shadows(panorama: Panorama) -> Panorama {
    if panorama.extent().width > MAX_AROUND.width {
        panorama.resized(MAX_AROUND)
    } else {
        panorama
    }
}

/// The exposure of a panorama: by what is seen of it, where brightness is to be matched, and as it is given beyond that;
/// `light` that is its own binds it to the objects.
fn exposed(
    scene: &SceneDescription,
    panorama: &Panorama,
    scale: [f32; 3],
    light: Option<&ShLight>,
) -> PanoramaExposure {
    let Extent { width, height } = scene.panorama_extent();
    let side = |side: usize| (side * LOOK / width.max(height).max(1)).max(1);
    let view = PanoramaView::new(
        Extent::new(side(width), side(height)),
        scene.fov,
        scene.down,
    );
    let seen = view.exposed(panorama, 0.0, scale);
    let found = if scene.matches {
        PanoramaExposure::new(&seen, light)
    } else {
        PanoramaExposure::fixed(&seen, 0.0)
    };
    found.brighter(&seen, scene.exposure)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use relight_core::image::{ColourImage, Planes, Samples, StoredImage, Transfer};
    use relight_core::light::{Order, ShLight};

    use super::*;
    use crate::decompose::PhotoHints;
    use crate::relighting::DiscLamp;

    fn described(more: &str) -> SceneDescription {
        let text = format!("background = \"a.hdr\"\n{more}\n[[object]]\nphoto = \"b.jpg\"");
        SceneDescription::parse(&text).unwrap()
    }

    fn sky() -> Panorama {
        let even = ShLight::even(Order::TWO, [0.2, 0.4, 1.0]);
        Panorama::from_light(&even, Extent::new(32, 16))
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
        let plain = SceneEnvironment::new(&scene, background, None).unwrap();
        assert_eq!(plain.extent, Extent::new(200, 100));
        assert_eq!(plain.light, LightSource::Panorama(panorama.clone()));
        // The sky is even: it is brought to the brightness of a bright place, and the objects with it, as a white one would be.
        let exposure = plain.exposure.unwrap();
        assert!(exposure.clipped == 0.0 && !exposure.for_objects);
        assert_eq!(plain.harmonisation.level, WHITE * exposure.stops.exp2());
        assert_eq!(plain.harmonisation.balance, [1.0; 3]);
        let view = PanoramaView::new(plain.extent, scene.fov, scene.down);
        let shown = |environment: &SceneEnvironment| {
            let seen = environment.seen(&view, &panorama, 0.0);
            seen.planes().pixel(100, 50)[1]
        };
        let brighter = described("size = [200, 100]\nexposure = 1.0");
        let brighter = SceneEnvironment::new(&brighter, background, None).unwrap();
        assert!((brighter.harmonisation.level / plain.harmonisation.level - 2.0).abs() < 1e-5);
        assert!((shown(&brighter) / shown(&plain) - 2.0).abs() < 1e-5);
    }

    #[test]
    fn a_lamp_before_a_panorama_leaves_both_as_bright_as_they_are_wanted() {
        let bright = ShLight::even(Order::TWO, [40.0; 3]);
        let panorama = Panorama::from_light(&bright, Extent::new(32, 16));
        let background = SceneBackground::Panorama(&panorama);
        let lamp = LightSource::Lamp("170,30".parse().unwrap());
        let scene = described("size = [200, 100]");
        let set = SceneEnvironment::new(&scene, background, Some(lamp)).unwrap();
        assert_eq!(set.harmonisation.level, 1.0);
        let view = PanoramaView::new(set.extent, scene.fov, scene.down);
        let shown = set.seen(&view, &panorama, 0.0).planes().pixel(100, 50)[1];
        assert!((shown - 0.8).abs() < 0.01, "{shown}");
        assert!(set.exposure.unwrap().clipped == 0.0);
    }

    #[test]
    fn nothing_is_matched_where_nobody_asks_and_a_camera_may_be_balanced_for_the_light() {
        let panorama = sky();
        let background = SceneBackground::Panorama(&panorama);
        let unmatched = described("size = [200, 100]\nmatch = false");
        let unmatched = SceneEnvironment::new(&unmatched, background, None).unwrap();
        assert_eq!(unmatched.harmonisation, Harmonisation::default());
        let balanced = described("size = [200, 100]\nwhite_balance = \"auto\"");
        let balanced = SceneEnvironment::new(&balanced, background, None).unwrap();
        let view = PanoramaView::new(balanced.extent, 60.0, 10.0);
        let [r, g, b] = balanced.seen(&view, &panorama, 0.0).planes().pixel(9, 9);
        assert!((r / b - 1.0).abs() < 0.01 && (g / b - 1.0).abs() < 0.01);
        assert!((g - 0.8).abs() < 0.02, "{g}");
        // Before a picture, the light is as coloured as the picture's.
        let lamp: DiscLamp = "60,30,2700K".parse().unwrap();
        let scene = described("white_balance = \"auto\"");
        let dusk = dusk();
        let picture = SceneBackground::Picture(&dusk);
        let set = SceneEnvironment::new(&scene, picture, Some(LightSource::Lamp(lamp))).unwrap();
        let LightSource::Lamp(shown) = set.light else {
            panic!("a lamp")
        };
        assert!((shown.colour[0] / shown.colour[2] - 1.0).abs() < 1e-6);
        assert!(set.harmonisation.balance[0] > set.harmonisation.balance[2]);
    }

    #[test]
    fn a_picture_is_followed_in_brightness_and_only_given_light_in_colour() {
        let (picture, scene) = (dusk(), described(""));
        let background = SceneBackground::Picture(&picture);
        let taken = SceneEnvironment::new(&scene, background, None).unwrap();
        assert_eq!(taken.extent, Extent::new(64, 48));
        assert!(taken.harmonisation.level < 0.5 && taken.harmonisation.balance == [1.0; 3]);
        let lamp = LightSource::Lamp(DiscLamp::default());
        let scene = described("white_balance = \"light\"");
        let given = SceneEnvironment::new(&scene, background, Some(lamp.clone())).unwrap();
        assert_eq!(given.light, lamp);
        assert!(given.harmonisation.balance[0] > given.harmonisation.balance[2]);
        let unmatched = SceneEnvironment::new(&described("match = false"), background, Some(lamp));
        assert_eq!(unmatched.unwrap().harmonisation, Harmonisation::default());
    }

    #[test]
    fn the_cast_of_light_from_a_picture_is_limited_as_a_lamp_s_is_and_neutral_light_is_not_changed()
    {
        let of = |picture: &Rgb<Linear>, more: &str| {
            let background = SceneBackground::Picture(picture);
            SceneEnvironment::new(&described(more), background, None).unwrap()
        };
        let colour = |more| {
            let mean = of(&dusk(), more).projected.coefficients()[0];
            mean.map(|channel| 3.0 * channel / mean.iter().sum::<f64>())
        };
        let (kept, used) = (colour("white_balance = \"light\""), colour(""));
        // The picture is 0.3, 0.2, 0.1: after von Kries, with D = 0.7726, 1.5 becomes 0.7726 + 0.2274 x 1.5.
        for (found, (used, wanted)) in kept.iter().zip(used.iter().zip([1.5, 1.0, 0.5])) {
            assert!((found - wanted).abs() < 0.01, "{kept:?}");
            assert!((used - 0.7726 - 0.2274 * wanted).abs() < 0.01, "{used}");
        }
        let grey = Rgb::new(dusk().into_planes().map(|_| 0.4));
        let [plain, kept] = ["", "white_balance = \"light\""].map(|more| of(&grey, more));
        let sides = [plain.light, kept.light].map(|light| light.light().unwrap());
        let [plain, kept] = sides.each_ref().map(|light| light.coefficients()[0]);
        for channel in 0..3 {
            assert!((plain[channel] / kept[channel] - 1.0).abs() < 1e-6);
        }
        let lamp = LightSource::Lamp(DiscLamp::default());
        let background = dusk();
        let background = SceneBackground::Picture(&background);
        let given = SceneEnvironment::new(&described(""), background, Some(lamp)).unwrap();
        assert!(!given.is_estimated);
    }

    #[test]
    fn the_ground_is_looked_down_on_as_far_as_the_camera_sees_it() {
        let panorama = sky();
        let tilt = |more: &str, background| {
            let environment = SceneEnvironment::new(&described(more), background, None);
            environment.unwrap().tilt
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
        let black = Panorama::from_light(&ShLight::dark(Order::TWO), Extent::new(32, 16));
        let refused =
            SceneEnvironment::new(&described(""), SceneBackground::Panorama(&black), None);
        let refused = refused.unwrap_err().to_string();
        assert!(refused.contains("dark"), "{refused}");
    }

    #[test]
    fn a_photograph_is_brought_to_the_size_in_which_its_object_is_shown() {
        let extent = Extent::new(400, 300);
        let picture = Planes::filled(extent, [0.5; 3]);
        // The object is 150 rows high, and shown in half of 48 rows.
        let mask = Planes::from_fn(extent, |_, y| {
            [f32::from(u8::from((100..250).contains(&y))); 3]
        });
        let stored = |planes| StoredImage {
            planes,
            alpha: None,
            samples: Samples::Float,
        };
        let path = Path::new("a");
        let mask = stored(mask);
        let hints = PhotoHints {
            mask: Some((path, &mask)),
            ..PhotoHints::default()
        };
        let picture = ColourImage::new(stored(picture), Transfer::Linear);
        let photo = Photo::from_image(path, picture, &hints).unwrap();
        let background = dusk();
        let environment =
            SceneEnvironment::new(&described(""), SceneBackground::Picture(&background), None);
        let object = ObjectDescription {
            height: 0.5,
            ..described("").objects[0].clone()
        };
        let downscaled = environment.unwrap().downscaled(&object, photo);
        // 400 x 0.5 x 48 x 1.25 / 150 pixels.
        assert_eq!(downscaled.picture.planes().extent(), Extent::new(80, 60));
        assert_eq!(rows(&downscaled.mask).len(), 30);
    }
}
