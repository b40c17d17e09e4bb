//! The object's mask: from a photograph, a file or a rectangle.

use image::RgbImage;

use super::crop::inside;
use relight_core::image::{Planes, beside, connected_parts, reached};
use relit_data::geometry::Rect;
use relit_grabcut::{MaskError, SegmentSettings, segment};

/// Encoded values up to this count as nearly black: 12 of 255.
pub(super) const NEARLY_BLACK: f32 = 12.5 / 255.0;
/// The least black part of the photograph's edge for a black background.
const BLACK_EDGE: f64 = 0.95;

/// The source of the mask.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MaskSource {
    /// A file of a mask.
    File,
    /// The photograph's alpha.
    Alpha,
    /// The background is black: the object is the largest part that is not.
    BlackBackground,
    /// A rectangle, within which the object was cut out.
    Rectangle,
}

/// Why the colours of a photograph do not show where the object is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NoObject {
    /// There is something at the photograph's edge.
    Background,
    /// All is black.
    Black,
}

/// The object within a rectangle of a photograph in sRGB, cut out as by `relit-mask --rect`, and what a person should check.
pub(super) fn cut_out_within(
    encoded: &Planes<3>,
    rectangle: Rect,
) -> Result<(Planes<1>, Vec<String>), MaskError> {
    let [width, height] = encoded.extent().sides();
    let frame = RgbImage::from_raw(width, height, encoded.to_bytes()).unwrap_or_default();
    let found = segment(&frame, &rectangle.into(), &SegmentSettings::default())?;
    let level = |x, y| found.image.get_pixel(x as u32, y as u32).0[0];
    let mask = Planes::from_fn(encoded.extent(), |x, y| [f32::from(level(x, y)) / 255.0]);
    Ok((mask, found.warnings))
}

/// The mask that alpha shows, within the rectangle if there is one.
pub(super) fn mask_of_alpha(alpha: &Planes<1>, rectangle: Option<Rect>) -> Planes<1> {
    let [width, _] = alpha.extent().sides();
    let mut mask = alpha.clone();
    for (at, value) in mask.planes_mut()[0].iter_mut().enumerate() {
        let is_within = rectangle.is_none_or(|rectangle| rectangle.contains(at, width));
        *value = f32::from(u8::from(is_within && *value >= 0.5));
    }
    mask
}

/// The largest part of a photograph in sRGB that is not black, with the dark places in it, if its edge is black. NaN is
/// black.
pub(super) fn before_black(encoded: &Planes<3>) -> Result<Planes<1>, NoObject> {
    let extent = encoded.extent();
    let [red, green, blue] = encoded.planes();
    let is_black = |at: usize| {
        let brightest = red[at].max(green[at]).max(blue[at]);
        brightest.is_nan() || brightest <= NEARLY_BLACK
    };
    let edge: Vec<usize> = (0..extent.pixels())
        .filter(|&at| beside(extent, at).contains(&None))
        .collect();
    let black = edge.iter().filter(|&&at| is_black(at)).count();
    if (black as f64) < BLACK_EDGE * edge.len() as f64 {
        return Err(NoObject::Background);
    }
    let mut open: Vec<bool> = (0..extent.pixels()).map(is_black).collect();
    let mut is_object = vec![true; extent.pixels()];
    for from in edge {
        for at in reached(extent, from, &mut open) {
            is_object[at] = false;
        }
    }
    // The first of those that are equally large.
    let parts = connected_parts(extent, is_object).into_iter().rev();
    let largest = parts.max_by_key(Vec::len).ok_or(NoObject::Black)?;
    let mut mask = Planes::zeros(extent);
    let [plane] = mask.planes_mut();
    for at in largest {
        plane[at] = 1.0;
    }
    Ok(mask)
}

/// Whether a mask is nowhere at least one half.
pub(super) fn is_empty(mask: &Planes<1>) -> bool {
    !inside(mask).contains(&true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::image::Extent;

    /// A bright ring of radius 6 to 12 about (20, 20), black inside, and a speck far away.
    fn ring(background: f32) -> Planes<3> {
        Planes::from_fn(Extent::new(48, 40), |x, y| {
            let distance = (x as f32 - 20.0).hypot(y as f32 - 20.0);
            let is_speck = (x, y) == (40, 30);
            if (6.0..=12.0).contains(&distance) || is_speck {
                [0.7; 3]
            } else if distance < 6.0 {
                [0.0; 3]
            } else {
                [background; 3]
            }
        })
    }

    #[test]
    fn before_black_the_object_is_the_largest_part_with_its_dark_places() {
        let mask = before_black(&ring(0.01)).unwrap();
        assert_eq!(mask.pixel(20, 20), [1.0]);
        assert_eq!(mask.pixel(20, 10), [1.0]);
        assert_eq!(mask.pixel(2, 2), [0.0]);
        assert_eq!(mask.pixel(40, 30), [0.0]);
        assert_eq!(before_black(&ring(0.3)), Err(NoObject::Background));
    }

    #[test]
    fn within_a_rectangle_the_object_is_cut_out_of_its_background() {
        let disc = Planes::from_fn(Extent::new(96, 64), |x, y| {
            if (x as f32 - 48.0).hypot(y as f32 - 32.0) <= 18.0 {
                [0.86, 0.7, 0.16]
            } else {
                [0.08, (x % 7) as f32 / 255.0, 0.24]
            }
        });
        let (mask, warnings) = cut_out_within(&disc, Rect::new(24, 8, 50, 48)).unwrap();
        assert!(warnings.is_empty(), "{warnings:?}");
        for (x, y, wanted) in [(48, 32, 1.0), (48, 15, 1.0), (28, 12, 0.0), (10, 10, 0.0)] {
            assert_eq!(mask.pixel(x, y), [wanted], "{x} {y}");
        }
        let beside = cut_out_within(&disc, Rect::new(200, 0, 5, 5));
        assert!(matches!(beside, Err(MaskError::Hints(_))), "{beside:?}");
    }

    #[test]
    fn a_rectangle_cuts_what_alpha_says() {
        let alpha = Planes::from_fn(Extent::new(48, 40), |x, _| [x as f32 / 47.0]);
        let mask = mask_of_alpha(&alpha, Some(Rect::new(0, 0, 30, 40)));
        assert_eq!(mask.plane(0).iter().sum::<f32>(), 6.0 * 40.0);
        let mask = mask_of_alpha(&alpha, None);
        assert_eq!(mask.plane(0).iter().sum::<f32>(), 24.0 * 40.0);
    }

    #[test]
    fn a_black_photograph_shows_no_object() {
        for value in [0.0, f32::NAN, -1.0] {
            let black = Planes::filled(Extent::new(8, 8), [value; 3]);
            assert_eq!(before_black(&black), Err(NoObject::Black));
        }
    }

    #[test]
    fn a_background_that_is_no_number_is_black() {
        assert_eq!(before_black(&ring(f32::NAN)), before_black(&ring(0.0)));
    }
}
