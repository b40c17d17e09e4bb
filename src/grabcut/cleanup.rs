//! From GrabCut's result to a mask: small components dropped, holes filled, the edge softened.

use image::GrayImage;

use super::bitmap::{Bitmap, Component, Connectivity};
use super::blur::blur;
use super::{Feather, Mark, Seeds};

/// Width of the rise from 10 % to 90 % of a Gaussian edge, in standard deviations.
const RISE: f64 = 2.563;

/// A component with at least this share of the largest one's area is kept.
const KEPT_FROM: f64 = 0.3;

/// The cleaned mask, and what was changed.
#[derive(Debug)]
pub(super) struct Cleaned {
    pub(super) mask: Bitmap,
    /// Number of 8-connected components before the clean-up.
    pub(super) components: usize,
    /// Number of components that were kept.
    pub(super) kept: usize,
    /// The components that were dropped, in the order of their first pixels.
    pub(super) dropped: Vec<Component>,
    /// Pixels that the seeds mark as object and that were dropped nevertheless.
    pub(super) dropped_marks_px: u64,
    /// The holes that were filled, in the order of their first pixels.
    pub(super) holes: Vec<Component>,
    /// The largest of them that what the seeds mark as object encloses.
    pub(super) closed_by_marks: Option<Component>,
}

/// Keeps the largest component and those of a similar size, or with `keep_all` every one, and fills
/// holes of at most `fill_to` times the object's area, except those in which the seeds mark background.
pub(super) fn clean(raw: &Bitmap, seeds: Option<&Seeds>, keep_all: bool, fill_to: f64) -> Cleaned {
    let components = raw.components(Connectivity::Eight);
    let largest = components.largest();
    let least = largest.map_or(0.0, |at| components.list[at].area as f64 * KEPT_FROM);
    let is_kept = |component: usize| keep_all || components.list[component].area as f64 >= least;
    let kept = raw.map(|at, _| components.at(at).is_some_and(is_kept));
    let (mask, holes, closed_by_marks) = fill_holes(&kept, seeds, fill_to);
    let all = || components.list.iter().enumerate();
    Cleaned {
        components: components.list.len(),
        kept: all().filter(|&(index, _)| is_kept(index)).count(),
        dropped: all()
            .filter(|&(index, _)| !is_kept(index))
            .map(|(_, component)| *component)
            .collect(),
        dropped_marks_px: marked(seeds, Mark::Object)
            .filter(|&at| !mask.bits().get(at).copied().unwrap_or(true))
            .count() as u64,
        mask,
        holes,
        closed_by_marks,
    }
}

/// Fills the holes: background that is not 4-connected to the border (4, because the object is
/// 8-connected).
fn fill_holes(
    object: &Bitmap,
    seeds: Option<&Seeds>,
    fill_to: f64,
) -> (Bitmap, Vec<Component>, Option<Component>) {
    let ground = object.inverted();
    let components = ground.components(Connectivity::Four);
    let frame = object.map(|_, _| true).bounds();
    let most = object.count() as f64 * fill_to;
    let mut is_hole: Vec<bool> = components
        .list
        .iter()
        .map(|component| {
            let bounds = component.bounds;
            component.area as f64 <= most
                && bounds.x > 0
                && bounds.y > 0
                && bounds.right() < frame.right()
                && bounds.bottom() < frame.bottom()
        })
        .collect();
    for index in marked(seeds, Mark::Background).filter_map(|at| components.at(at)) {
        is_hole[index] = false;
    }
    let in_hole = |at: usize| components.at(at).is_some_and(|index| is_hole[index]);
    let filled = object.map(|at, bit| bit || in_hole(at));
    let holes = components.list.iter().zip(&is_hole);
    let holes = holes.filter(|&(_, &hole)| hole);
    let holes: Vec<Component> = holes.map(|(hole, _)| *hole).collect();
    let width = frame.w as usize;
    let beside = |at: usize| {
        let above = at.checked_sub(width);
        [at.checked_sub(1), Some(at + 1), above, Some(at + width)]
    };
    let closed = marked(seeds, Mark::Object).flat_map(beside).flatten();
    let closed = closed.filter_map(|at| components.at(at).filter(|&index| is_hole[index]));
    let largest = closed
        .map(|index| components.list[index])
        .max_by_key(|hole| hole.area);
    (filled, holes, largest)
}

/// The pixels that the seeds mark as `wanted`.
fn marked(seeds: Option<&Seeds>, wanted: Mark) -> impl Iterator<Item = usize> {
    let marks = seeds.map_or(&[][..], Seeds::marks).iter().enumerate();
    marks
        .filter(move |&(_, &mark)| mark == wanted)
        .map(|(at, _)| at)
}

/// The mask as an image: 0 and 255, with a Gaussian edge between them if `feather` is not 0. Set pixels
/// are at least 128 and the others less, so that a threshold gives the mask back.
pub(super) fn soften(mask: &Bitmap, size: (u32, u32), feather: Feather) -> GrayImage {
    let hard: Vec<u8> = mask
        .bits()
        .iter()
        .map(|&bit| if bit { 255 } else { 0 })
        .collect();
    let levels = if feather.px() == 0 {
        hard
    } else {
        let soft = blur(&hard, size, f64::from(feather.px()) / RISE);
        let sided = soft.iter().zip(mask.bits());
        sided
            .map(|(&level, &bit)| if bit { level.max(128) } else { level.min(127) })
            .collect()
    };
    GrayImage::from_raw(size.0, size.1, levels).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use image::{DynamicImage, Luma};

    use super::*;

    const RING: [&str; 6] = [
        "#......", //
        ".####..", //
        ".#..#..", //
        ".####.#", //
        "......#", //
        ".......",
    ];

    fn seeds(size: (u32, u32), marks: &[(u32, u32, u8)]) -> Seeds {
        let mut image = GrayImage::from_pixel(size.0, size.1, Luma([128]));
        for &(x, y, level) in marks {
            image.put_pixel(x, y, Luma([level]));
        }
        Seeds::from_image(&DynamicImage::from(image)).unwrap()
    }

    #[test]
    fn the_largest_component_is_kept_and_its_hole_is_filled() {
        let cleaned = clean(&Bitmap::drawn(&RING), None, false, 1.0);
        let wanted = [
            "#......", ".####..", ".####..", ".####..", ".......", ".......",
        ];
        assert_eq!(cleaned.mask, Bitmap::drawn(&wanted));
        assert_eq!((cleaned.components, cleaned.kept), (2, 1));
        assert_eq!(cleaned.dropped[0].area, 2);
        assert_eq!(cleaned.holes[0].area, 2);
    }

    #[test]
    fn every_component_is_kept_on_request() {
        let cleaned = clean(&Bitmap::drawn(&RING), None, true, 1.0);
        assert_eq!((cleaned.components, cleaned.kept), (2, 2));
        assert!(cleaned.dropped.is_empty());
        assert_eq!(cleaned.mask.count(), 15);
    }

    #[test]
    fn a_hole_marked_as_background_stays_open() {
        let marks = seeds((7, 6), &[(1, 1, 255), (2, 2, 0)]);
        let cleaned = clean(&Bitmap::drawn(&RING), Some(&marks), false, 1.0);
        assert!(cleaned.holes.is_empty());
        assert_eq!(cleaned.mask.count(), 11);
    }

    #[test]
    fn a_hole_that_a_mark_closed_is_named_and_others_are_not() {
        let open = clean(&Bitmap::drawn(&RING), None, false, 1.0);
        assert_eq!(open.closed_by_marks, None);
        let marks = seeds((7, 6), &[(3, 1, 255)]);
        let closed = clean(&Bitmap::drawn(&RING), Some(&marks), false, 1.0);
        assert_eq!(closed.closed_by_marks.map(|hole| hole.area), Some(2));
    }

    #[test]
    fn a_dropped_mark_is_counted() {
        let marks = seeds((7, 6), &[(6, 4, 255), (1, 1, 255)]);
        let cleaned = clean(&Bitmap::drawn(&RING), Some(&marks), false, 1.0);
        assert_eq!(cleaned.dropped_marks_px, 1);
    }

    #[test]
    fn a_bay_that_is_open_to_the_border_is_not_a_hole() {
        let bay = Bitmap::drawn(&["###", "#.#", "#.#"]);
        assert_eq!(clean(&bay, None, false, 1.0).mask, bay);
    }

    #[test]
    fn a_soft_edge_is_as_wide_as_asked_and_gives_the_mask_back() {
        let size = (200, 3);
        let mask = Bitmap::new(size, (0..600).map(|at| at % 200 < 100));
        let soft = soften(&mask, size, Feather::new(20).unwrap());
        let row = &soft.as_raw()[..200];
        let rising = row.iter().filter(|&&v| (26..=229).contains(&v)).count();
        assert!((18..=22).contains(&rising), "{rising}");
        assert!(
            row.iter()
                .enumerate()
                .all(|(x, &v)| (v >= 128) == (x < 100))
        );
        assert_eq!((row[0], row[199]), (255, 0));
    }

    #[test]
    fn a_mask_finer_than_its_feather_survives_the_threshold() {
        let mask = Bitmap::drawn(&[".......", "...#...", "......."]);
        let soft = soften(&mask, (7, 3), Feather::new(100).unwrap());
        let back: Vec<bool> = soft.as_raw().iter().map(|&v| v >= 128).collect();
        assert_eq!(back, mask.bits());
    }
}
