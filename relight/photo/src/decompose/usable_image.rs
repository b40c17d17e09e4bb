//! Pictures of floating point values, whatever their units and faults, made usable as light.

use super::decomposer::usable;
use relight_core::image::{ColourImage, Planes, Samples, StoredImage, Transfer};
use relit_data::statistics::above_part;

/// If a larger part of the pixels that are not black is at or above 1, a picture is not in units in which 1 is white.
const MAX_WHITE: f64 = 0.5;
/// The part of the pixels that are not black which is darker than white.
const WHITE_PERCENTILE: f64 = 0.99;

/// A picture whose values are light: finite, not negative, and in units in which 1 is white.
#[derive(Debug, Clone)]
pub struct UsableImage {
    /// The picture.
    pub image: ColourImage,
    /// What its values were multiplied with; 1 if its units were right.
    pub scale: f32,
    /// What a person may want to know of it, as clauses.
    pub notes: Vec<String>,
}

impl UsableImage {
    /// Makes a picture usable. Integers are as they are; of floating point values, negative ones become 0, and so do those that
    /// are infinite or not numbers, which a note counts. If more than half of the pixels that are not black are at or above
    /// 1 in their brightest channel, all are scaled so that the 99th percentile of these pixels is 1, with a note.
    #[must_use]
    pub fn new(image: ColourImage) -> Self {
        let mut notes = Vec::new();
        if image.stored().samples == Samples::Integer {
            let scale = 1.0;
            return Self {
                image,
                scale,
                notes,
            };
        }
        let alpha = image.stored().alpha.clone();
        let planes = image.into_light().into_planes();
        let values = planes.planes().into_iter().flatten();
        let odd = values.filter(|value| !value.is_finite()).count();
        if odd > 0 {
            notes.push(format!(
                "{odd} of its values are infinite or not numbers and count as black"
            ));
        }
        let mut planes = planes.map(usable);
        let mut scale = 1.0;
        if let Some(white) = white_of_other_units(&planes) {
            scale = white.recip();
            planes = planes.map(|value| value / white);
            notes.push(format!(
                "its values are not in units in which 1 is white: multiplied by {scale}"
            ));
        }
        let stored = StoredImage {
            planes,
            alpha,
            samples: Samples::Float,
        };
        Self {
            image: ColourImage::new(stored, Transfer::Linear),
            scale,
            notes,
        }
    }
}

/// The white of a picture in which 1 is not white.
fn white_of_other_units(light: &Planes<3>) -> Option<f32> {
    let lit = || light.brightest().filter(|&value| value > 0.0);
    let white = lit().filter(|&value| value >= 1.0).count();
    if white as f64 <= MAX_WHITE * lit().count() as f64 {
        return None;
    }
    above_part(lit(), WHITE_PERCENTILE).filter(|&white| white > 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::image::Extent;

    /// A ramp up to `most` before black.
    fn ramp(most: f32) -> Planes<3> {
        Planes::from_fn(Extent::new(40, 20), |x, y| {
            let light = if y < 10 {
                0.0
            } else {
                most * ((x + 1) as f32 / 40.0)
            };
            [light, 0.5 * light, 0.25 * light]
        })
    }

    fn of(planes: Planes<3>, samples: Samples) -> UsableImage {
        let stored = StoredImage {
            planes,
            alpha: None,
            samples,
        };
        UsableImage::new(ColourImage::new(stored, Transfer::Linear))
    }

    fn light(usable: UsableImage) -> Planes<3> {
        usable.image.into_light().into_planes()
    }

    #[test]
    fn units_in_which_1_is_not_white_are_scaled_and_others_are_not() {
        for most in [0.3, 1.0, 1.9] {
            let found = of(ramp(most), Samples::Float);
            assert_eq!((found.scale, found.notes.len()), (1.0, 0), "{most}");
            assert_eq!(light(found), ramp(most));
        }
        for most in [2.5, 255.0, 1000.0, 3e38] {
            let found = of(ramp(most), Samples::Float);
            assert!((found.scale * most - 1.0).abs() < 0.03, "{most}");
            assert!(found.notes[0].contains(&found.scale.to_string()));
            let light = light(found);
            assert_eq!(light.pixel(39, 15)[0], 1.0);
            assert!((light.pixel(19, 15)[0] - 0.5).abs() < 1e-6);
        }
    }

    #[test]
    fn what_is_no_light_becomes_black_and_is_counted_unless_it_is_negative() {
        let mut planes = ramp(1.0);
        planes.set_pixel(3, 12, [f32::NAN, f32::INFINITY, 0.25]);
        planes.set_pixel(4, 12, [-0.5, 0.25, 0.125]);
        let found = of(planes, Samples::Float);
        assert!(found.notes.len() == 1 && found.notes[0].contains('2'));
        let light = light(found);
        assert_eq!(light.pixel(3, 12), [0.0, 0.0, 0.25]);
        assert_eq!(light.pixel(4, 12), [0.0, 0.25, 0.125]);
    }

    #[test]
    fn integers_are_as_they_are_however_white() {
        let white = Planes::filled(Extent::new(4, 4), [1.0; 3]);
        let found = of(white.clone(), Samples::Integer);
        assert_eq!((found.scale, found.notes.len()), (1.0, 0));
        assert_eq!(light(found), white);
        // Nothing is brighter than white in it either.
        assert_eq!(of(white, Samples::Float).scale, 1.0);
    }
}
