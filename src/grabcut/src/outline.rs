//! The outline of a mask as polygons, for drawing it at any scale.

use std::collections::BTreeMap;

use image::GrayImage;

use super::bitmap::Bitmap;

/// Ways along the pixels' sides, each to the right of the one before: right, down, left, up. The mask is to their right.
const HEADINGS: [(i64, i64); 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];
/// The row and column, from a pixel's, of the corner where the way along each of its sides begins.
const BEGINS: [(i64, i64); 4] = [(0, 0), (0, 1), (1, 1), (1, 0)];

/// A corner of pixels: row and column.
type Corner = (i64, i64);
/// The ways along the mask's edge, by the corner from which they lead on. At most two lead on from one corner.
type Sides = BTreeMap<Corner, Vec<usize>>;

/// The edges between the mask's pixels (from 128 on) and the others, as closed polygons along the pixels'
/// sides: corners `[x, y]`, 0 to width and height, without those at which the direction stays the same. Filled
/// by the even-odd rule they cover the mask exactly. Pixels that touch at a corner are connected.
pub fn outline(mask: &GrayImage) -> Vec<Vec<[u32; 2]>> {
    let mut sides = sides(mask);
    let mut polygons = Vec::new();
    while let Some((&start, _)) = sides.first_key_value() {
        let mut corners = Vec::new();
        let mut at = start;
        let mut heading = None;
        while let Some(next) = take(&mut sides, at, heading) {
            if heading != Some(next) {
                corners.push([at.1 as u32, at.0 as u32]);
            }
            let (dx, dy) = HEADINGS[next];
            at = (at.0 + dy, at.1 + dx);
            heading = Some(next);
        }
        polygons.push(corners);
    }
    polygons
}

fn sides(mask: &GrayImage) -> Sides {
    let (width, height) = (i64::from(mask.width()), i64::from(mask.height()));
    let object = Bitmap::from_mask(mask);
    let inside = |x: i64, y: i64| {
        let within = (0..width).contains(&x) && (0..height).contains(&y);
        within && object.bits()[(y * width + x) as usize]
    };
    let mut sides = Sides::new();
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (y, x)));
    for (y, x) in pixels.filter(|&(y, x)| inside(x, y)) {
        for (heading, (row, column)) in BEGINS.into_iter().enumerate() {
            let (dx, dy) = HEADINGS[(heading + 3) % 4];
            if !inside(x + dx, y + dy) {
                let ways = sides.entry((y + row, x + column)).or_default();
                ways.push(heading);
            }
        }
    }
    sides
}

/// Takes the way that leads on from a corner: of two, the one to the left, which goes over to the pixel
/// that touches at the corner.
fn take(sides: &mut Sides, at: Corner, heading: Option<usize>) -> Option<usize> {
    let leading = sides.get_mut(&at)?;
    let left = heading.map(|heading| (heading + 3) % 4);
    let place = leading.iter().position(|&next| Some(next) == left);
    let taken = leading.swap_remove(place.unwrap_or(0));
    if leading.is_empty() {
        sides.remove(&at);
    }
    Some(taken)
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
