//! The turntable itself: still, dark, without colour or structure, below the object.

use super::temporal_evidence::TemporalEvidence;
use crate::bitmap::{Bitmap, Connectivity};

/// Largest average brightness, as a feature.
const MAX_LIGHT: f32 = 50.0 / 3.0;
/// Largest average chroma, as a feature.
const MAX_CHROMA: f32 = 14.0 / 3.0;
/// Largest change of the brightness, as a feature.
const MAX_CHANGE: f32 = 7.5;
/// What has edges in this share of the frames is not plain: those of shadows pass by.
const STRUCTURE: f32 = 0.3;
/// The table covers at least this share of the frame.
const MIN_PART: f64 = 0.01;
/// It comes as near to the lower border as this share of the height, or is this share of the width wide.
const FOOT: f64 = 0.03;
const WIDE: f64 = 0.35;
/// The object may divide the table: another part of it is at least this share of the least size, and differs at most so much
/// in brightness and colour, as features.
const JOINED: f64 = 0.1;
const PART_LIGHT: f32 = 2.0;
const PART_COLOUR: f32 = 2.0;

/// The largest brightness that a shadow on the table has beyond the table's, as a feature.
const SHADOW_LIGHT: f32 = 0.3;
/// How far the colour of a shadow is from the table's, as a feature.
const SHADOW_COLOUR: f32 = 0.8;
/// A shadow reaches at most this share of the frame's height beyond the plain surface.
const SHADOW_REACH: f64 = 0.08;

/// The table, as far as it is seen.
#[derive(Debug)]
pub(crate) struct Turntable {
    /// Its plain surface.
    pub(crate) surface: Bitmap,
    /// Darker pixels of the same colour next to it: where the object shadows it all the time.
    pub(crate) shadow: Bitmap,
    /// All that is as dark, still and plain as a table, connected with its surface or not.
    pub(crate) plain: Bitmap,
}

/// The table, from the features of a turn (average L, a, b, changes of light and colour), the share of frames with an
/// edge next to each pixel, and the curves of brightness. Empty if none is found.
pub(crate) fn find_turntable(
    features: &[[f32; 5]],
    lasting: &[f32],
    curves: &TemporalEvidence,
    size: (usize, usize),
) -> Turntable {
    let (width, height) = size;
    let dark = |at: usize| {
        let [light, a, b, change, _] = features[at];
        light < MAX_LIGHT && a.hypot(b) < MAX_CHROMA && change < MAX_CHANGE
    };
    let plain = (0..features.len()).map(|at| dark(at) && lasting[at] < STRUCTURE);
    let plain = Bitmap::new((width as u32, height as u32), plain);
    // Away from its border, so that it does not run into the object through a gap in the outline.
    let inner = plain.inverted().dilated(1).inverted();
    let components = inner.components(Connectivity::Four);
    let mut below = vec![0_usize; components.list.len()];
    for at in height * 2 / 3 * width..width * height {
        if let Some(component) = components.at(at) {
            below[component] += 1;
        }
    }
    let least = (width * height) as f64 * MIN_PART;
    let (below, components) = (&below, &components);
    let parts = |least: f64| {
        let large = components.list.iter().enumerate();
        let large = large.filter(move |&(at, part)| below[at] > 0 && part.area as f64 >= least);
        large.map(|(at, _)| (at, inner.map(|pixel, _| components.at(pixel) == Some(at))))
    };
    // A dark floor of the room is as far below, but shows something else all the time.
    let score = |at: usize, part: &Bitmap| {
        let residual = curves.residual_of(part).unwrap_or(1.0);
        below[at] as f32 / residual.sqrt()
    };
    let scored = parts(least).map(|(at, part)| (score(at, &part), part));
    let best = scored.max_by(|(one, _), (other, _)| one.total_cmp(other));
    let nothing = || inner.minus(&inner);
    let mut found = best.map_or_else(nothing, |(_, part)| part);
    if let Some(of_table) = mean(features, &found) {
        for (_, part) in parts(JOINED * least) {
            if is_alike(&of_table, mean(features, &part)) && curves.together(&part, &found) {
                found = found.or(&part);
            }
        }
    }
    let bounds = found.bounds();
    let gap = height as i64 - bounds.bottom();
    if gap as f64 > height as f64 * FOOT && f64::from(bounds.w) < width as f64 * WIDE {
        found = nothing();
    }
    let surface = found.dilated(1);
    let shadow = shadow(features, lasting, &surface, size);
    Turntable {
        surface,
        shadow,
        plain,
    }
}

/// Whether the average colour of a part is about that of the table.
fn is_alike(table: &[f32; 3], part: Option<[f32; 3]>) -> bool {
    part.is_some_and(|[light, a, b]| {
        (light - table[0]).abs() < PART_LIGHT && (a - table[1]).hypot(b - table[2]) < PART_COLOUR
    })
}

/// Grows from the surface, row by row and column by column, over what may be its shadow.
fn shadow(
    features: &[[f32; 5]],
    lasting: &[f32],
    surface: &Bitmap,
    size: (usize, usize),
) -> Bitmap {
    let Some(mean) = mean(features, surface) else {
        return surface.clone();
    };
    let may_be = |at: usize| {
        let [light, a, b, ..] = features[at];
        light < mean[0] + SHADOW_LIGHT
            && (a - mean[1]).hypot(b - mean[2]) < SHADOW_COLOUR
            && lasting[at] < STRUCTURE
    };
    let mut grown = surface.clone();
    for _ in 0..(size.1 as f64 * SHADOW_REACH) as usize {
        grown = grown.or(&grown.dilated(1).map(|at, near| near && may_be(at)));
    }
    grown.minus(surface)
}

/// The average colour of the surface; `None` if it is empty.
fn mean(features: &[[f32; 5]], surface: &Bitmap) -> Option<[f32; 3]> {
    let mut sum = [0.0_f32; 3];
    let pixels = features.iter().zip(surface.bits());
    for (feature, _) in pixels.filter(|(_, on)| **on) {
        sum.iter_mut().zip(feature).for_each(|(s, v)| *s += v);
    }
    let count = surface.count();
    (count > 0).then(|| sum.map(|s| s / count as f32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::turn::temporal_evidence::Curves;

    const SIZE: (usize, usize) = (40, 30);

    /// A dark object on a dark table in a bright room, with an edge at every outline.
    fn scene() -> (Vec<[f32; 5]>, Vec<f32>) {
        let kind = |x: usize, y: usize| match (x, y) {
            (15..25, 8..22) => 2,
            (4..36, 18..) => 1,
            _ => 0,
        };
        let feature = |at: usize| match kind(at % 40, at / 40) {
            0 => [25.0, 1.0, 2.0, 9.0, 3.0],
            _ => [8.0, 0.2, 0.1, 3.0, 0.5],
        };
        let lasting = |at: usize| {
            let (x, y) = (at % 40, at / 40);
            let near = [
                (x + 1, y),
                (x.saturating_sub(1), y),
                (x, y + 1),
                (x, y.saturating_sub(1)),
            ];
            let differs = near
                .iter()
                .any(|&(i, j)| kind(i.min(39), j.min(29)) != kind(x, y));
            if differs { 1.0 } else { 0.1 }
        };
        (
            (0..1200).map(feature).collect(),
            (0..1200).map(lasting).collect(),
        )
    }

    fn no_curves() -> TemporalEvidence {
        Curves::new(0, 1200).finish()
    }

    #[test]
    fn the_table_is_found_and_the_dark_object_on_it_is_not() {
        let (features, lasting) = scene();
        let table = find_turntable(&features, &lasting, &no_curves(), SIZE);
        let at = |x: usize, y: usize| table.surface.bits()[y * 40 + x];
        assert!(at(8, 24) && at(30, 28) && at(20, 27));
        assert!(!at(20, 12) && !at(20, 20) && !at(2, 2));
    }

    #[test]
    fn without_a_table_nothing_is_found() {
        let (features, lasting) = scene();
        let bright: Vec<_> = features
            .iter()
            .map(|f| [f[0] + 20.0, f[1], f[2], f[3], f[4]])
            .collect();
        let table = find_turntable(&bright, &lasting, &no_curves(), SIZE);
        assert_eq!(table.surface.count(), 0);
    }
}
