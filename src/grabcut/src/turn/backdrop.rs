//! What is behind and below the object: evidence for background from the rows' ends and the table.
//!
//! In a whole turn each piece of the room passes through the whole width of the image, so that a pixel of
//! the background has the same average and the same changes as the ends of its row, wherever it is. A
//! pixel that differs from both ends is object, or says nothing; one that equals them is background.
//! Where the two ends of the rows differ (no whole turn, or a second object at the border), the
//! evidence is weak. Ends that show the table are left to the search for the table.

use super::table::Turntable;
use crate::bitmap::Bitmap;
use crate::cut::grab_cut::squared_distance;

/// Share of the width from which each end of a row is averaged.
const END: f64 = 0.03;
/// Rows above and below that are compared too, as a share of the height.
const ROWS: f64 = 0.012;
/// Squared distance of equal surfaces, in squared units of the features.
const ALIKE: f32 = 1.0;
/// Where the end of a row changes by less than this, as a feature, it is overexposed: without noise, and so much stricter.
const CLIPPED: f32 = 0.3;
const CLIPPED_ALIKE: f32 = 0.05;
/// Evidence of a pixel that equals its row's ends, in units of the log-likelihood.
const STRENGTH: f32 = 8.0;
/// Evidence of a pixel in the object's shadow on the table.
const SHADOW_STRENGTH: f32 = 2.0;
/// Evidence of a pixel of the table's rim, which may have any colour.
const RIM_STRENGTH: f32 = 25.0;
/// The rim of the table, between table and room, is at most twice this share of the width wide.
const RIM: f64 = 0.014;

/// Evidence from the rows' ends and the table.
#[derive(Debug)]
pub(crate) struct Backdrop {
    /// The pixels that are background at first.
    pub(crate) alike: Bitmap,
    /// What each pixel's position says, in units of the log-likelihood: 0 for nothing, negative for
    /// background.
    pub(crate) evidence: Vec<f32>,
}

impl Backdrop {
    /// From the features of an image of `size` (average L, a, b, then the changes of light and colour)
    /// and the table.
    pub(crate) fn new(features: &[[f32; 5]], table: &Turntable, size: (usize, usize)) -> Self {
        let ends = Ends::new(features, &table.surface, size);
        let distance: Vec<f32> = (0..features.len())
            .map(|at| ends.distance(&features[at], at / size.0))
            .collect();
        let dimensions = (size.0 as u32, size.1 as u32);
        let room = distance.iter().map(|&distance| distance < ends.alike);
        let room = Bitmap::new(dimensions, room);
        let alike = with_rim(&room, &table.surface, size.0);
        let evidence = distance.iter().enumerate().map(|(at, &distance)| {
            let equal = (-distance / (2.0 * ends.alike)).exp();
            let is_surface = room.bits()[at] || table.surface.bits()[at];
            match (alike.bits()[at], table.shadow.bits()[at]) {
                (true, _) if is_surface => -STRENGTH,
                (true, _) => -RIM_STRENGTH,
                (false, true) => -SHADOW_STRENGTH,
                (false, false) => -STRENGTH * equal,
            }
        });
        Self {
            evidence: evidence.collect(),
            alike: alike.or(&table.shadow),
        }
    }
}

/// Room and table, and the thin rim between them.
fn with_rim(room: &Bitmap, table: &Bitmap, width: usize) -> Bitmap {
    let radius = ((width as f64 * RIM).round() as usize).max(1);
    let both = room.or(table);
    let near_both = room
        .dilated(2 * radius + 1)
        .and(&table.dilated(2 * radius + 1));
    both.or(&both.closed(radius).and(&near_both))
}

/// The average features at the ends of each row; `None` if they show the table.
struct Ends {
    left: Vec<Option<[f32; 5]>>,
    right: Vec<Option<[f32; 5]>>,
    reach: usize,
    /// Squared distance up to which pixels are alike.
    alike: f32,
}

impl Ends {
    fn new(features: &[[f32; 5]], table: &Bitmap, (width, height): (usize, usize)) -> Self {
        let depth = ((width as f64 * END).round() as usize).clamp(1, width.max(1));
        let end = |y: usize, from: usize| {
            let span = y * width + from..y * width + from + depth;
            let on_table = table.bits()[span.clone()].contains(&true);
            (!on_table).then(|| mean(&features[span]))
        };
        let left: Vec<_> = (0..height).map(|y| end(y, 0)).collect();
        let right: Vec<_> = (0..height).map(|y| end(y, width - depth)).collect();
        let pairs = left.iter().zip(&right);
        let mut apart: Vec<f32> = pairs
            .filter_map(|(left, right)| Some(squared_distance(left.as_ref()?, right.as_ref()?)))
            .collect();
        apart.sort_by(f32::total_cmp);
        let typical = apart.get(apart.len() / 2).copied().unwrap_or(0.0);
        Self {
            left,
            right,
            reach: (height as f64 * ROWS).ceil() as usize,
            alike: ALIKE + typical.min(ALIKE),
        }
    }

    /// The squared distance of a pixel to the nearer end of its row, or of a row near it.
    fn distance(&self, feature: &[f32; 5], y: usize) -> f32 {
        let rows = y.saturating_sub(self.reach)..(y + self.reach + 1).min(self.left.len());
        rows.flat_map(|row| [&self.left[row], &self.right[row]])
            .flatten()
            .map(|end| {
                let alike = if end[3] < CLIPPED { CLIPPED_ALIKE } else { 1.0 };
                squared_distance(feature, end) / alike
            })
            .fold(f32::INFINITY, f32::min)
    }
}

fn mean(features: &[[f32; 5]]) -> [f32; 5] {
    let mut sum = [0.0; 5];
    for feature in features {
        sum.iter_mut().zip(feature).for_each(|(s, v)| *s += v);
    }
    sum.map(|s| s / features.len().max(1) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A room whose rows differ, with an object of another colour in the middle.
    fn room(object: impl Fn(usize, usize) -> bool) -> Vec<[f32; 5]> {
        let feature = |at: usize| {
            let (x, y) = (at % 40, at / 40);
            if object(x, y) {
                [20.0, 5.0, 5.0, 2.0, 1.0]
            } else {
                [10.0 + y as f32 * 0.3, 0.0, 1.0, 5.0, 2.0]
            }
        };
        (0..40 * 30).map(feature).collect()
    }

    fn no_table() -> Turntable {
        let nothing = Bitmap::new((40, 30), std::iter::empty());
        Turntable {
            surface: nothing.clone(),
            shadow: nothing.clone(),
            plain: nothing,
        }
    }

    #[test]
    fn what_equals_the_ends_of_its_row_is_background_and_the_rest_is_open() {
        let inside = |x: usize, y: usize| (12..28).contains(&x) && (8..22).contains(&y);
        let backdrop = Backdrop::new(&room(inside), &no_table(), (40, 30));
        for (at, &alike) in backdrop.alike.bits().iter().enumerate() {
            assert_eq!(alike, !inside(at % 40, at / 40), "{at}");
        }
        assert!(backdrop.evidence[0] < -5.0);
        assert!(backdrop.evidence[15 * 40 + 20] > -0.1);
    }

    #[test]
    fn what_is_nearly_as_white_as_an_overexposed_room_is_not_the_room() {
        let feature = |at: usize| match (12..28).contains(&(at % 40)) {
            true => [33.2, 0.0, 0.0, 0.8, 0.2],
            false => [33.3, 0.0, 0.0, 0.0, 0.0],
        };
        let features: Vec<[f32; 5]> = (0..40 * 30).map(feature).collect();
        let backdrop = Backdrop::new(&features, &no_table(), (40, 30));
        assert!(!backdrop.alike.bits()[15 * 40 + 20] && backdrop.alike.bits()[15 * 40 + 5]);
    }

    #[test]
    fn the_rim_between_room_and_table_is_background_and_a_thin_part_of_the_object_is_not() {
        // A stick in the room, the rim below it, the table below that.
        let stick = |x: usize, y: usize| x == 20 && (5..12).contains(&y);
        let rim = |x: usize, y: usize| y == 15 && (3..37).contains(&x);
        let features = room(|x, y| stick(x, y) || rim(x, y));
        let table = Turntable {
            surface: no_table().surface.map(|at, _| at / 40 > 15),
            ..no_table()
        };
        let backdrop = Backdrop::new(&features, &table, (40, 30));
        let at = |x: usize, y: usize| backdrop.alike.bits()[y * 40 + x];
        assert!(at(20, 15) && at(10, 15));
        assert!(!at(20, 8));
    }
}
