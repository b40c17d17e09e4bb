//! The nearest set pixel of each pixel of a bitmap.

use crate::bitmap::Bitmap;

/// For each pixel the position of the nearest set one; none if none is set. By two passes over the image: in rare cases
/// another one is nearer by less than a pixel.
pub(super) fn nearest(set: &Bitmap) -> Option<Vec<usize>> {
    if set.count() == 0 {
        return None;
    }
    let width = set.width();
    let height = set.bits().len() / width;
    let bits = set.bits().iter().enumerate();
    let mut found: Vec<Option<usize>> = bits.map(|(at, &bit)| bit.then_some(at)).collect();
    let pass = |found: &mut Vec<Option<usize>>, order: &mut dyn Iterator<Item = usize>| {
        for at in order {
            for near in neighbours(at, (width, height)) {
                let (own, other) = (found[at], found[near]);
                let distance = |place: Option<usize>| {
                    place.map_or(usize::MAX, |place| squared_distance(at, place, width))
                };
                if distance(other) < distance(own) {
                    found[at] = other;
                }
            }
        }
    };
    // The second pair of passes reaches what lies behind corners.
    for _ in 0..2 {
        pass(&mut found, &mut (0..width * height));
        pass(&mut found, &mut (0..width * height).rev());
    }
    found.into_iter().collect()
}

fn squared_distance(a: usize, b: usize, width: usize) -> usize {
    let (across, down) = (
        (a % width).abs_diff(b % width),
        (a / width).abs_diff(b / width),
    );
    across * across + down * down
}

/// The up to eight pixels around one.
fn neighbours(at: usize, (width, height): (usize, usize)) -> impl Iterator<Item = usize> {
    let (x, y) = (at % width, at / width);
    let rows = y.saturating_sub(1)..(y + 2).min(height);
    rows.flat_map(move |row| {
        let columns = x.saturating_sub(1)..(x + 2).min(width);
        columns.map(move |column| row * width + column)
    })
    .filter(move |&near| near != at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pixel_has_the_nearest_set_one() {
        let set = Bitmap::drawn(&["#.......", "........", "........", ".......#"]);
        let found = nearest(&set).unwrap();
        assert_eq!((found[0], found[31]), (0, 31));
        assert_eq!((found[2], found[8 + 1], found[2 * 8 + 6]), (0, 0, 31));
        assert_eq!(nearest(&Bitmap::drawn(&["...."])), None);
    }
}
