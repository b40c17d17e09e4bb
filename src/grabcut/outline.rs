//! The outline of a mask as polygons, for drawing it at any scale.

use std::collections::BTreeMap;

use image::GrayImage;

/// Pixels at or above this level belong to the mask.
const INSIDE_FROM: u8 = 128;

/// The edges between the mask's pixels (from 128 on) and the others, as closed polygons along the pixels'
/// sides: corners `[x, y]`, 0 to width and height, without those at which the direction stays the same. Filled
/// by the even-odd rule they cover the mask exactly. Pixels that touch at a corner are connected.
#[must_use]
pub fn outline(mask: &GrayImage) -> Vec<Vec<[u32; 2]>> {
    let mut steps = steps(mask);
    let mut polygons = Vec::new();
    while let Some((&start, _)) = steps.first_key_value() {
        let mut corners = Vec::new();
        let mut at = start;
        let mut heading = None;
        while let Some(next) = take(&mut steps, at, heading) {
            if heading != Some(next) {
                corners.push([at.1, at.0]);
            }
            at = moved(at, next);
            heading = Some(next);
        }
        polygons.push(corners);
    }
    polygons
}

/// A direction along the pixels' sides; the mask is to its right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Heading {
    Right,
    Down,
    Left,
    Up,
}

/// A corner of pixels: row and column.
type Corner = (u32, u32);

/// The sides of the mask's pixels at its edge, by the corner from which they lead on. At most two lead on
/// from one corner.
fn steps(mask: &GrayImage) -> BTreeMap<Corner, Vec<Heading>> {
    let (width, height) = mask.dimensions();
    let inside = |x: i64, y: i64| {
        let within = (0..i64::from(width)).contains(&x) && (0..i64::from(height)).contains(&y);
        within && mask.get_pixel(x as u32, y as u32).0[0] >= INSIDE_FROM
    };
    let mut steps: BTreeMap<Corner, Vec<Heading>> = BTreeMap::new();
    for (x, y, pixel) in mask.enumerate_pixels() {
        if pixel.0[0] < INSIDE_FROM {
            continue;
        }
        let (column, row) = (i64::from(x), i64::from(y));
        let sides = [
            (!inside(column, row - 1), (y, x), Heading::Right),
            (!inside(column + 1, row), (y, x + 1), Heading::Down),
            (!inside(column, row + 1), (y + 1, x + 1), Heading::Left),
            (!inside(column - 1, row), (y + 1, x), Heading::Up),
        ];
        for (_, corner, heading) in sides.into_iter().filter(|side| side.0) {
            steps.entry(corner).or_default().push(heading);
        }
    }
    steps
}

/// Takes the side that leads on from a corner: of two, the one to the left, which goes over to the pixel
/// that touches at the corner.
fn take(
    steps: &mut BTreeMap<Corner, Vec<Heading>>,
    at: Corner,
    heading: Option<Heading>,
) -> Option<Heading> {
    let leading = steps.get_mut(&at)?;
    let left = heading.map(|heading| match heading {
        Heading::Right => Heading::Up,
        Heading::Down => Heading::Right,
        Heading::Left => Heading::Down,
        Heading::Up => Heading::Left,
    });
    let place = leading.iter().position(|&next| Some(next) == left);
    let taken = leading.swap_remove(place.unwrap_or(0));
    if leading.is_empty() {
        steps.remove(&at);
    }
    Some(taken)
}

fn moved((row, column): Corner, heading: Heading) -> Corner {
    match heading {
        Heading::Right => (row, column + 1),
        Heading::Down => (row + 1, column),
        Heading::Left => (row, column - 1),
        Heading::Up => (row - 1, column),
    }
}

#[cfg(test)]
mod tests {
    use image::Luma;
    use proptest::prelude::*;

    use super::*;

    fn mask_of(width: u32, height: u32, bits: &[bool]) -> GrayImage {
        GrayImage::from_fn(width, height, |x, y| {
            Luma([if bits[(y * width + x) as usize] {
                255
            } else {
                0
            }])
        })
    }

    /// Whether a ray to the right from the pixel's middle crosses an odd number of sides.
    fn is_inside(polygons: &[Vec<[u32; 2]>], x: u32, y: u32) -> bool {
        let crossed = |polygon: &Vec<[u32; 2]>| {
            let ends = polygon.iter().cycle().skip(1);
            let sides = polygon.iter().zip(ends);
            let crosses = |(a, b): &(&[u32; 2], &[u32; 2])| {
                a[0] == b[0] && a[0] > x && a[1].min(b[1]) <= y && y < a[1].max(b[1])
            };
            sides.filter(crosses).count()
        };
        polygons.iter().map(crossed).sum::<usize>() % 2 == 1
    }

    #[test]
    fn a_rectangle_has_four_corners_and_its_hole_four_more() {
        let bits: Vec<bool> = (0..49)
            .map(|at| {
                let (x, y) = (at % 7, at / 7);
                (1..6).contains(&x) && (1..6).contains(&y) && (x, y) != (3, 3)
            })
            .collect();
        let polygons = outline(&mask_of(7, 7, &bits));
        assert_eq!(polygons[0], [[1, 1], [6, 1], [6, 6], [1, 6]]);
        assert_eq!(polygons[1].len(), 4);
        assert_eq!(polygons.len(), 2);
    }

    #[test]
    fn an_empty_mask_has_no_outline() {
        assert!(outline(&GrayImage::new(4, 4)).is_empty());
        assert!(outline(&GrayImage::new(0, 0)).is_empty());
    }

    proptest! {
        #[test]
        fn the_polygons_cover_the_mask_exactly(bits in prop::collection::vec(any::<bool>(), 63)) {
            let polygons = outline(&mask_of(9, 7, &bits));
            for (at, &bit) in bits.iter().enumerate() {
                let (x, y) = (at as u32 % 9, at as u32 / 9);
                prop_assert_eq!(is_inside(&polygons, x, y), bit);
            }
        }
    }
}
