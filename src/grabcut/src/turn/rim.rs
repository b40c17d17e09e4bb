//! The table's rim in a result: where the rig shakes, the rim between table and room is neither the one nor
//! the other on average, and hangs on the object as a thin line.

use super::table::Turntable;
use crate::bitmap::{Bitmap, Component, Connectivity};

/// A line is at most twice this share of the frame's width wide.
const WIDTH: f64 = 0.005;
/// The table begins at most this share of the frame's width below it, and the room as far above it.
const REACH: f64 = 0.03;
/// A line is at least so many times as long as it is thick on average, and longer than the widest line is wide.
const LENGTH: u64 = 4;
/// This share of a line's pixels has the table below and the room above.
const BETWEEN: f64 = 0.4;

/// The object without thin lines that have the table below and the room above them.
pub(crate) fn without_rim(object: &Bitmap, table: &Turntable, size: (usize, usize)) -> Bitmap {
    let radius = ((size.0 as f64 * WIDTH).round() as usize).max(1);
    let reach = ((size.0 as f64 * REACH).round() as usize).max(2);
    let thin = object.minus(&object.opened(radius));
    let between = thin.map(|at, bit| bit && is_between(at, object, table, size, reach));
    let rim = thin.parts_where(Connectivity::Eight, |line, pixels| {
        let count = || between.and(&pixels()).count() as f64;
        is_line(line, radius) && count() >= BETWEEN * line.area as f64
    });
    object.minus(&rim)
}

fn is_line(component: &Component, radius: usize) -> bool {
    let length = u64::from(component.bounds.w);
    // Its mean thickness is its area by its length.
    length >= 2 * radius as u64 && length * length >= LENGTH * component.area
}

/// Whether there is a plain dark surface below a pixel, and something else than that and the object above.
fn is_between(
    at: usize,
    object: &Bitmap,
    table: &Turntable,
    (width, height): (usize, usize),
    reach: usize,
) -> bool {
    let (x, y) = (at % width, at / width);
    let is_plain = |at: usize| !object.bits()[at] && table.plain.bits()[at];
    let mut below = (y + 1..(y + reach + 1).min(height)).map(|row| row * width + x);
    let mut above = (y.saturating_sub(reach)..y)
        .rev()
        .map(|row| row * width + x);
    let first_above = above.find(|&at| !object.bits()[at]);
    below.any(is_plain) && first_above.is_some_and(|at| !is_plain(at))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (80, 60);

    fn bitmap(set: impl Fn(usize, usize) -> bool) -> Bitmap {
        Bitmap::new((80, 60), (0..4800).map(|at| set(at % 80, at / 80)))
    }

    fn table() -> Turntable {
        Turntable {
            surface: bitmap(|_, y| y > 41),
            shadow: bitmap(|_, _| false),
            plain: bitmap(|_, y| y > 41),
        }
    }

    #[test]
    fn the_rim_beside_the_object_is_taken_away() {
        let body = |x: usize, y: usize| (30..50).contains(&x) && (10..50).contains(&y);
        let rim = |x: usize, y: usize| (5..75).contains(&x) && (39..41).contains(&y);
        let object = bitmap(|x, y| body(x, y) || rim(x, y));
        let left = without_rim(&object, &table(), SIZE);
        assert_eq!(left, bitmap(body));
    }

    #[test]
    fn a_short_piece_of_the_rim_is_taken_away_too() {
        let body = |x: usize, y: usize| (30..50).contains(&x) && (10..50).contains(&y);
        let spike = |x: usize, y: usize| (50..56).contains(&x) && y == 41;
        let object = bitmap(|x, y| body(x, y) || spike(x, y));
        let left = without_rim(&object, &table(), SIZE);
        assert_eq!(left, bitmap(body));
    }

    #[test]
    fn thin_parts_of_the_object_stay() {
        // A handle in the room, and a stick that lies on the table.
        let handle = |x: usize, y: usize| {
            (50..64).contains(&x) && (14..16).contains(&y)
                || (62..64).contains(&x) && (14..30).contains(&y)
        };
        let stick = |x: usize, y: usize| (50..70).contains(&x) && (46..48).contains(&y);
        let body = |x: usize, y: usize| (30..50).contains(&x) && (10..50).contains(&y);
        let object = bitmap(|x, y| body(x, y) || handle(x, y) || stick(x, y));
        assert_eq!(without_rim(&object, &table(), SIZE), object);
    }
}
