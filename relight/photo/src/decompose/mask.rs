//! The object's mask: from a photograph, a file or a rectangle.

use super::crop::inside;
use relight_core::image::{Extent, Planes, beside};
use relit_data::geometry::Rect;

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
    /// A rectangle, all of it.
    Rectangle,
    /// The mask of a shard's frame.
    Shard,
}

/// Why the colours of a photograph do not show where the object is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NoObject {
    /// There is something at the photograph's edge.
    Background,
    /// All is black.
    Black,
}

/// The mask that the photograph itself shows, cut by the rectangle if there is one: its alpha, or what is
/// not black where its edge is black, or else the rectangle. `encoded` are the values as the file has
/// them.
pub(super) fn find_mask(
    encoded: &Planes<3>,
    alpha: Option<&Planes<1>>,
    rectangle: Option<Rect>,
) -> Result<(Planes<1>, MaskSource), NoObject> {
    let extent = encoded.extent();
    let found = match alpha {
        Some(alpha) => Ok((binary(alpha.clone()), MaskSource::Alpha)),
        None => before_black(encoded).map(|mask| (mask, MaskSource::BlackBackground)),
    };
    let Some(rectangle) = rectangle else {
        return found;
    };
    let (mut mask, source) =
        found.unwrap_or_else(|_| (Planes::filled(extent, [1.0]), MaskSource::Rectangle));
    let Extent { width, .. } = extent;
    let (columns, rows) = (
        i64::from(rectangle.x)..rectangle.right(),
        i64::from(rectangle.y)..rectangle.bottom(),
    );
    for (at, value) in mask.planes_mut()[0].iter_mut().enumerate() {
        let (x, y) = ((at % width) as i64, (at / width) as i64);
        if !(columns.contains(&x) && rows.contains(&y)) {
            *value = 0.0;
        }
    }
    Ok((mask, source))
}

fn binary(mask: Planes<1>) -> Planes<1> {
    mask.map(|value| f32::from(u8::from(value >= 0.5)))
}

/// The largest part of the photograph that is not black, with the dark places in it. NaN
/// is black.
fn before_black(encoded: &Planes<3>) -> Result<Planes<1>, NoObject> {
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
    let mut seen = vec![false; extent.pixels()];
    for at in edge.into_iter().filter(|&at| is_black(at)) {
        grow(extent, at, &mut seen, is_black);
    }
    // Every pixel of the background has been seen now, and none of the object.
    let mut largest: Vec<usize> = Vec::new();
    for at in 0..extent.pixels() {
        if !seen[at] {
            let part = grow(extent, at, &mut seen, |_| true);
            if part.len() > largest.len() {
                largest = part;
            }
        }
    }
    if largest.is_empty() {
        return Err(NoObject::Black);
    }
    let mut mask = Planes::zeros(extent);
    let [plane] = mask.planes_mut();
    for at in largest {
        plane[at] = 1.0;
    }
    Ok(mask)
}

/// The pixels that are reached from one over their sides, as far as they are `wanted` and were not seen;
/// they are seen then.
fn grow(
    extent: Extent,
    from: usize,
    seen: &mut [bool],
    wanted: impl Fn(usize) -> bool,
) -> Vec<usize> {
    if seen[from] {
        return Vec::new();
    }
    seen[from] = true;
    let mut found = vec![from];
    let mut next = 0;
    while let Some(&at) = found.get(next) {
        next += 1;
        for other in beside(extent, at).into_iter().flatten() {
            if !seen[other] && wanted(other) {
                seen[other] = true;
                found.push(other);
            }
        }
    }
    found
}

/// Whether a mask is nowhere at least one half.
pub(super) fn is_empty(mask: &Planes<1>) -> bool {
    !inside(mask).contains(&true)
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let (mask, source) = find_mask(&ring(0.01), None, None).unwrap();
        assert_eq!(source, MaskSource::BlackBackground);
        assert_eq!(mask.pixel(20, 20), [1.0]);
        assert_eq!(mask.pixel(20, 10), [1.0]);
        assert_eq!(mask.pixel(2, 2), [0.0]);
        assert_eq!(mask.pixel(40, 30), [0.0]);
    }

    #[test]
    fn before_anything_else_only_a_rectangle_says_where_the_object_is() {
        let grey = ring(0.3);
        assert_eq!(find_mask(&grey, None, None), Err(NoObject::Background));
        let rectangle = Rect::new(40, 10, 100, 5);
        let (mask, source) = find_mask(&grey, None, Some(rectangle)).unwrap();
        assert_eq!(source, MaskSource::Rectangle);
        assert_eq!(mask.plane(0).iter().sum::<f32>(), 8.0 * 5.0);
        assert_eq!(mask.pixel(47, 14), [1.0]);
    }

    #[test]
    fn a_rectangle_cuts_what_alpha_says() {
        let alpha = Planes::from_fn(Extent::new(48, 40), |x, _| [x as f32 / 47.0]);
        let rectangle = Rect::new(0, 0, 30, 40);
        let (mask, source) = find_mask(&ring(0.0), Some(&alpha), Some(rectangle)).unwrap();
        assert_eq!(source, MaskSource::Alpha);
        assert_eq!(mask.plane(0).iter().sum::<f32>(), 6.0 * 40.0);
    }

    #[test]
    fn a_black_photograph_shows_no_object() {
        for value in [0.0, f32::NAN, -1.0] {
            let black = Planes::filled(Extent::new(8, 8), [value; 3]);
            assert_eq!(find_mask(&black, None, None), Err(NoObject::Black));
        }
    }

    #[test]
    fn a_background_that_is_no_number_is_black() {
        let (mask, source) = find_mask(&ring(f32::NAN), None, None).unwrap();
        assert_eq!(source, MaskSource::BlackBackground);
        assert_eq!(mask, find_mask(&ring(0.0), None, None).unwrap().0);
    }
}
