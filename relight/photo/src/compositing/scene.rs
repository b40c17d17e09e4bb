//! Objects in a new picture: in its light, with their shadows.

use super::harmonisation::grain;
use super::layer::{GroundShadow, SceneLayer};
use super::shadow::Shadow;
use super::{Harmonisation, SceneObject};
use crate::relighting::{Fit, InsertError, PlacedObject, exposure_between};
use relight_core::image::{Extent, Linear, Planes, Rgb};
use relight_core::light::{Direction, Panorama, Rotation, ShLight};

/// A picture that objects are put into.
#[derive(Debug)]
pub struct InsertScene<'a> {
    extent: Extent,
    light: ShLight,
    /// The same light, as shadows are drawn from it.
    panorama: Panorama,
    tilt: f64,
    harmonisation: Harmonisation,
    /// Whether the light says how bright objects are beside the background.
    has_brightness_of_light: bool,
    objects: Vec<SceneObject<'a>>,
}

impl<'a> InsertScene<'a> {
    /// A picture of a size in this light, as coefficients and as a panorama, whose ground the camera looks down on by `tilt`
    /// degrees (0 to 90), with objects from back to front.
    ///
    /// # Errors
    /// If an object would lie outside, or be larger than can be.
    pub(crate) fn new(
        extent: Extent,
        (light, panorama): (ShLight, Panorama),
        tilt: f64,
        harmonisation: Harmonisation,
        objects: Vec<SceneObject<'a>>,
    ) -> Result<Self, InsertError> {
        for (number, object) in objects.iter().enumerate() {
            object.check(extent, number + 1)?;
        }
        let balance = harmonisation.balance.map(f64::from);
        Ok(Self {
            extent,
            light: light.tinted(balance),
            panorama,
            tilt: tilt.to_radians(),
            harmonisation,
            has_brightness_of_light: false,
            objects,
        })
    }

    /// The same scene, in which the mean brightness of objects follows the light wholly: before the panorama that lights them, an
    /// object is as bright as its mean irradiance and its albedo make it.
    pub(crate) fn with_brightness_of_light(mut self) -> Self {
        self.has_brightness_of_light = true;
        self
    }

    /// All objects after the light has rotated about the vertical by so many radians, from back to front.
    ///
    /// # Errors
    /// Those of the render layers.
    pub fn layers(&self, turn: f64) -> Result<Vec<SceneLayer>, InsertError> {
        let (light, panorama) = if turn == 0.0 {
            (self.light.clone(), self.panorama.clone())
        } else {
            let columns = self.panorama.extent().width;
            let part = (turn / std::f64::consts::TAU).rem_euclid(1.0);
            let rotation = Rotation::about(Direction::UP, turn);
            (
                self.light.rotated(&rotation),
                self.panorama
                    .turned((part * columns as f64).round() as usize),
            )
        };
        self.objects
            .iter()
            .map(|object| self.layer(object, &light, &panorama))
            .collect()
    }

    /// A background of the scene's size with the layers on it: first all shadows, then the objects. `frame` is the number of a
    /// video's frame, whose grain it draws.
    ///
    /// # Panics
    /// Where the background has another size.
    pub fn compose(
        &self,
        background: &Rgb<Linear>,
        layers: &[SceneLayer],
        frame: u64,
    ) -> Rgb<Linear> {
        assert_eq!(
            background.planes().extent(),
            self.extent,
            "size of the background"
        );
        let mut picture = background.clone();
        for layer in layers {
            layer.darken(picture.planes_mut());
        }
        for layer in layers {
            layer.cover(picture.planes_mut(), frame);
        }
        picture
    }

    fn layer(
        &self,
        object: &SceneObject<'_>,
        light: &ShLight,
        panorama: &Panorama,
    ) -> Result<SceneLayer, InsertError> {
        let relightable = object.relightable;
        let angle = object.placement.rotation.to_radians();
        let mut gain = object.exposure.exp2();
        let colours = if object.relit {
            // The background's brightness is no guess: it is not damped as the light's shape is.
            gain *= self.harmonisation.level;
            let scale = exposure_between(&relightable.light, &self.light);
            // The object is turned back, and the light with it.
            let turned = if angle == 0.0 {
                light.clone()
            } else {
                light.rotated(&Rotation::about(Direction::VIEWER, -angle))
            };
            let turned = turned.tinted([f64::from(scale); 3]);
            if self.has_brightness_of_light {
                relightable.relit_wholly(&turned, &object.change)?
            } else {
                relightable.relit(&turned, &object.change)?
            }
        } else {
            relightable.matte.foreground.clone()
        };
        let placed = relightable.placed(Fit::new(
            &relightable.matte.alpha,
            object.placement,
            self.extent,
        ));
        let premultiplied = colours.map(|v| v * gain);
        let premultiplied = premultiplied.zip(&relightable.matte.alpha, |v, a| v * a);
        let alpha = placed.alpha.clone();
        let colours = placed.fit.apply(&premultiplied);
        let place = placed.foot.first_pixel(object.placement, self.extent);
        let shadow = (object.shadow > 0.0)
            .then(|| self.shadow(object, &placed, panorama))
            .flatten()
            .map(|(from, arriving)| GroundShadow {
                place: [place[0] + from[0], place[1] + from[1]],
                arriving,
            });
        let grain = self.lacking_grain(&colours, &alpha);
        Ok(SceneLayer {
            place,
            alpha,
            colours,
            shadow,
            grain,
        })
    }

    /// The grain that the picture has and an object has not.
    fn lacking_grain(&self, colours: &Planes<3>, alpha: &Planes<1>) -> f32 {
        let wanted = self.harmonisation.grain;
        if wanted <= 0.0 {
            return 0.0;
        }
        let own = grain(colours, Some(alpha));
        (wanted.powi(2) - own.powi(2)).max(0.0).sqrt()
    }

    /// The shadow of an object, from its layer's first pixel.
    fn shadow(
        &self,
        object: &SceneObject<'_>,
        placed: &PlacedObject,
        panorama: &Panorama,
    ) -> Option<([i64; 2], Planes<3>)> {
        let height_field = placed.height_field(&object.relightable.normals)?;
        let shadow = Shadow::cast(height_field, self.tilt, panorama);
        let pixels = |cells: f64| cells / height_field.scale;
        let extent = shadow.arriving.extent();
        let side = |cells: usize| (pixels(cells as f64).round() as usize).max(1);
        let seen = shadow
            .arriving
            .resized(Extent::new(side(extent.width), side(extent.height)));
        let part = object.shadow.min(1.0);
        let arriving = seen.map(|arriving| 1.0 - part * (1.0 - arriving));
        Some((
            shadow.from.map(|cells| pixels(cells as f64).round() as i64),
            arriving,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decompose::{DecomposeOptions, Decomposer};
    use crate::nets::{Weights, decomposer};
    use crate::relighting::{DiscLamp, LightSource, MaterialChange, Placement, RelightableObject};
    use relight_core::image::{ColourSpace, Srgb};

    const PHOTO: Extent = Extent::new(60, 50);

    fn is_object(x: usize, y: usize) -> bool {
        (20..44).contains(&x) && (10..40).contains(&y)
    }

    fn photo() -> Rgb<Linear> {
        Rgb::new(Planes::from_fn(PHOTO, |x, y| {
            if is_object(x, y) {
                [0.5, 0.3, 0.2]
            } else {
                [0.1; 3]
            }
        }))
    }

    fn relightable() -> RelightableObject {
        let decomposer = Decomposer::with_side(&Weights::initial(&decomposer(), 3), 32).unwrap();
        let mask = Planes::from_fn(PHOTO, |x, y| [f32::from(u8::from(is_object(x, y)))]);
        RelightableObject::new(
            &photo(),
            &mask,
            None,
            &decomposer,
            &DecomposeOptions::default(),
        )
        .unwrap()
    }

    fn object(relightable: &RelightableObject, placement: Placement) -> SceneObject<'_> {
        SceneObject {
            relightable,
            placement,
            change: MaterialChange::default(),
            exposure: 0.0,
            shadow: 1.0,
            relit: false,
        }
    }

    fn lamp() -> (ShLight, Panorama) {
        let lamp = LightSource::Lamp(DiscLamp {
            azimuth: 90.0,
            elevation: 45.0,
            ..DiscLamp::default()
        });
        (lamp.light().unwrap(), lamp.panorama())
    }

    /// The object's place in its own photograph.
    const OWN_PLACE: Placement = Placement {
        at: [32.0 / 60.0, 40.0 / 50.0],
        height: 30.0 / 50.0,
        rotation: 0.0,
    };

    fn composed(extent: Extent, objects: Vec<SceneObject<'_>>) -> Rgb<Linear> {
        let white = Rgb::new(Planes::filled(extent, [0.8; 3]));
        let scene =
            InsertScene::new(extent, lamp(), 25.0, Harmonisation::default(), objects).unwrap();
        scene.compose(&white, &scene.layers(0.0).unwrap(), 0)
    }

    /// The columns and rows of the pixels that are as red as the object.
    fn bounds(picture: &Rgb<Linear>) -> [usize; 4] {
        let Extent { width, height } = picture.planes().extent();
        let is_red = |x: usize, y: usize| {
            let [red, green, _] = picture.planes().pixel(x, y);
            red > 1.4 * green
        };
        let places: Vec<[usize; 2]> = (0..height)
            .flat_map(|y| (0..width).map(move |x| [x, y]))
            .filter(|&[x, y]| is_red(x, y))
            .collect();
        let line = |axis: usize| places.iter().map(move |place| place[axis]);
        [line(0).min(), line(0).max(), line(1).min(), line(1).max()].map(Option::unwrap)
    }

    #[test]
    fn an_object_stands_where_it_is_wanted_and_as_high() {
        let relightable = relightable();
        let placement = Placement {
            at: [0.25, 0.75],
            height: 0.5,
            rotation: 0.0,
        };
        let picture = composed(Extent::new(160, 120), vec![object(&relightable, placement)]);
        let [left, right, top, bottom] = bounds(&picture);
        assert!(
            bottom.abs_diff(89) <= 1 && top.abs_diff(30) <= 1,
            "{top} {bottom}"
        );
        assert!(
            (left + right).abs_diff(79) <= 2 && (right - left).abs_diff(47) <= 2,
            "{left} {right}"
        );
    }

    #[test]
    fn at_its_own_place_it_covers_itself() {
        let relightable = relightable();
        let placement = OWN_PLACE;
        let scene = InsertScene::new(
            PHOTO,
            lamp(),
            25.0,
            Harmonisation::default(),
            vec![SceneObject {
                shadow: 0.0,
                ..object(&relightable, placement)
            }],
        );
        let scene = scene.unwrap();
        let picture = scene.compose(&photo(), &scene.layers(0.0).unwrap(), 0);
        for y in 0..PHOTO.height {
            for x in 0..PHOTO.width {
                let (a, b) = (picture.planes().pixel(x, y), photo().planes().pixel(x, y));
                assert!((a[0] - b[0]).abs() < 0.1, "{x} {y} {a:?} {b:?}");
            }
        }
    }

    #[test]
    fn turned_by_a_right_angle_it_is_as_wide_as_it_was_high() {
        let relightable = relightable();
        let placement = Placement {
            at: [0.5, 0.9],
            height: 0.4,
            rotation: 90.0,
        };
        let [left, right, top, bottom] = bounds(&composed(
            Extent::new(160, 120),
            vec![object(&relightable, placement)],
        ));
        let (width, height) = ((right - left + 1) as f64, (bottom - top + 1) as f64);
        assert!(
            (width - 48.0).abs() <= 2.0 && (width / height - 30.0 / 24.0).abs() < 0.08,
            "{width} {height}"
        );
    }

    #[test]
    fn the_front_covers_the_back_and_shadows_fall_on_the_ground() {
        let relightable = relightable();
        let place = |x| Placement {
            at: [x, 0.9],
            height: 0.5,
            rotation: 0.0,
        };
        let black = MaterialChange {
            tint: [0.0; 3],
            gloss: None,
        };
        let front = SceneObject {
            change: black,
            relit: true,
            ..object(&relightable, place(0.5))
        };
        let picture = composed(
            Extent::new(160, 120),
            vec![object(&relightable, place(0.5)), front],
        );
        assert!(picture.planes().pixel(80, 80)[0] < 0.05);
        // The lamp is on the right: the shadow lies on the left.
        let [left, right] = [40, 120].map(|x| picture.planes().pixel(x, 104)[0]);
        assert!(left < 0.7 && right > 0.75, "{left} {right}");
    }

    #[test]
    fn a_dark_background_with_grain_makes_the_object_so() {
        let relightable = relightable();
        let placement = Placement {
            at: [0.5, 0.9],
            height: 0.7,
            rotation: 0.0,
        };
        let relit = SceneObject {
            relit: true,
            shadow: 0.0,
            ..object(&relightable, placement)
        };
        let extent = Extent::new(160, 120);
        let black = Rgb::new(Planes::zeros(extent));
        let brightness = |harmonisation: Harmonisation, object: SceneObject<'_>| {
            let scene =
                InsertScene::new(extent, lamp(), 25.0, harmonisation, vec![object]).unwrap();
            let picture = scene.compose(&black, &scene.layers(0.0).unwrap(), 0);
            let middle: Vec<f32> = (70..90)
                .map(|x| Srgb::from_linear(picture.planes().pixel(x, 70)[1]))
                .collect();
            let mean = middle.iter().sum::<f32>() / middle.len() as f32;
            let noise = middle
                .windows(2)
                .map(|pair| (pair[0] - pair[1]).abs())
                .sum::<f32>()
                / 19.0;
            (mean, noise)
        };
        let plain = brightness(Harmonisation::default(), relit);
        let dark = brightness(
            Harmonisation {
                level: 0.25,
                ..Harmonisation::default()
            },
            relit,
        );
        assert!((Srgb::to_linear(dark.0) / Srgb::to_linear(plain.0) - 0.25).abs() < 0.05);
        // What the photograph shows there has no grain.
        let even = SceneObject {
            relit: false,
            ..relit
        };
        let grainy = brightness(
            Harmonisation {
                grain: 0.05,
                ..Harmonisation::default()
            },
            even,
        );
        let plain = brightness(Harmonisation::default(), even);
        assert!(grainy.1 > plain.1 + 0.02, "{grainy:?} {plain:?}");
    }

    #[test]
    fn what_cannot_stand_is_named() {
        let relightable = relightable();
        let refused = |placement| {
            let objects = vec![
                object(&relightable, OWN_PLACE),
                object(&relightable, placement),
            ];
            InsertScene::new(PHOTO, lamp(), 25.0, Harmonisation::default(), objects)
                .unwrap_err()
                .to_string()
        };
        let good = OWN_PLACE;
        for at in [
            [1.5, 0.9],
            [0.5, 1.9],
            [0.5, -0.1],
            [-0.4, 0.9],
            [f64::NAN, 0.5],
        ] {
            let found = refused(Placement {
                at,
                height: 0.4,
                rotation: 30.0,
            });
            assert!(found.contains("object 2"), "{found}");
        }
        let objects = vec![object(
            &relightable,
            Placement {
                height: 4.0,
                ..good
            },
        )];
        let error = InsertScene::new(
            Extent::new(4000, 4000),
            lamp(),
            25.0,
            Harmonisation::default(),
            objects,
        )
        .unwrap_err();
        assert!(error.to_string().starts_with("object 1 "), "{error}");
    }
}
