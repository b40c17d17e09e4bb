//! How good a mask is, measured against the ground truth.

use image::GrayImage;
use relit_data::geometry::Rect;

use super::bitmap::Bitmap;

/// An edge pixel is right if one of the other edge is within so many rows and columns.
pub const BOUNDARY_TOLERANCE_PX: u32 = 2;
/// Truth below this is background, and object above 255 minus it; between, it does not count.
const KNOWN_WITHIN: u8 = 64;
/// A mask's pixel belongs to the object from this level on.
const OBJECT_FROM: u8 = 128;

/// Figures of one mask.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaskScore {
    /// Wrong pixels, as a share of those that count in the region, 0..=1.
    pub error: f64,
    /// Intersection over union of mask and ground truth over the pixels that count, 0..=1.
    pub iou: f64,
    /// Harmonic mean of how much of the mask's edge is right and how much of the true edge was
    /// found, within [`BOUNDARY_TOLERANCE_PX`], 0..=1.
    pub boundary_f: f64,
}

/// Mask and ground truth, or the region, do not fit together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ScoreFault {
    /// They differ in size.
    #[error("the mask is {} x {} pixels and the ground truth {} x {}", .mask.0, .mask.1, .truth.0, .truth.1)]
    Size {
        /// Width and height of the mask, pixels.
        mask: (u32, u32),
        /// Width and height of the ground truth, pixels.
        truth: (u32, u32),
    },
    /// No pixel of the region counts.
    #[error("no pixel of the ground truth counts in the region")]
    NothingCounts,
}

/// Compares a mask (object from 128 on) with the ground truth (0 background, 255 object, 128 does not count).
/// The error is that inside `region`, of the whole image without one. Where the ground truth leaves a band
/// along the edge open, its middle stands for the edge.
///
/// # Errors
/// [`ScoreFault`].
pub fn score(
    mask: &GrayImage,
    truth: &GrayImage,
    region: Option<Rect>,
) -> Result<MaskScore, ScoreFault> {
    let size = truth.dimensions();
    if mask.dimensions() != size {
        return Err(ScoreFault::Size {
            mask: mask.dimensions(),
            truth: size,
        });
    }
    let found = Bitmap::new(
        size,
        mask.as_raw().iter().map(|&level| level >= OBJECT_FROM),
    );
    let known = |level: u8| match level {
        0..KNOWN_WITHIN => Some(false),
        level if level > 255 - KNOWN_WITHIN => Some(true),
        _ => None,
    };
    let truth: Vec<Option<bool>> = truth.as_raw().iter().map(|&level| known(level)).collect();
    let inside = |at: usize| {
        let (x, y) = ((at % size.0 as usize) as i64, (at / size.0 as usize) as i64);
        region.is_none_or(|rect| {
            (i64::from(rect.x)..rect.right()).contains(&x)
                && (i64::from(rect.y)..rect.bottom()).contains(&y)
        })
    };
    let (mut wrong, mut counted, mut both, mut either) = (0_u64, 0_u64, 0_u64, 0_u64);
    for (at, (&found, &truth)) in found.bits().iter().zip(&truth).enumerate() {
        let Some(truth) = truth else { continue };
        both += u64::from(found && truth);
        either += u64::from(found || truth);
        if inside(at) {
            counted += 1;
            wrong += u64::from(found != truth);
        }
    }
    if counted == 0 {
        return Err(ScoreFault::NothingCounts);
    }
    Ok(MaskScore {
        error: wrong as f64 / counted as f64,
        iou: if either == 0 {
            1.0
        } else {
            both as f64 / either as f64
        },
        boundary_f: boundary_f(&found, &resolved(&truth, size)),
    })
}

/// The ground truth with its open pixels given to the nearer side, step by step.
fn resolved(truth: &[Option<bool>], size: (u32, u32)) -> Bitmap {
    let (width, height) = (size.0 as usize, size.1 as usize);
    let mut known = truth.to_vec();
    let mut ring: Vec<usize> = (0..known.len()).filter(|&at| known[at].is_some()).collect();
    while !ring.is_empty() {
        let mut next = Vec::new();
        for at in ring {
            let (x, y) = (at % width, at / width);
            let around = [
                (x > 0).then(|| at - 1),
                (x + 1 < width).then(|| at + 1),
                (y > 0).then(|| at - width),
                (y + 1 < height).then(|| at + width),
            ];
            for near in around.into_iter().flatten() {
                if known[near].is_none() {
                    known[near] = known[at];
                    next.push(near);
                }
            }
        }
        ring = next;
    }
    Bitmap::new(size, known.into_iter().map(|side| side == Some(true)))
}

fn boundary_f(found: &Bitmap, truth: &Bitmap) -> f64 {
    let (found, truth) = (edge(found), edge(truth));
    let share = |of: &Bitmap, near: &Bitmap| {
        let near = near.dilated(BOUNDARY_TOLERANCE_PX as usize);
        let right = of
            .bits()
            .iter()
            .zip(near.bits())
            .filter(|(a, b)| **a && **b);
        (right.count() as f64, of.count() as f64)
    };
    let (right, all) = share(&found, &truth);
    let (seen, there) = share(&truth, &found);
    if all == 0.0 && there == 0.0 {
        return 1.0;
    }
    let (precision, recall) = (right / all.max(1.0), seen / there.max(1.0));
    2.0 * precision * recall / (precision + recall).max(f64::MIN_POSITIVE)
}

/// The object's pixels next to a background pixel, diagonals included; the image's border is no edge.
fn edge(object: &Bitmap) -> Bitmap {
    let near_background = object.inverted().dilated(1);
    object.map(|at, bit| bit && near_background.bits()[at])
}

#[cfg(test)]
mod tests {
    use image::Luma;

    use super::*;

    fn drawn(rows: &[&str]) -> GrayImage {
        let level = |x: u32, y: u32| match rows[y as usize].as_bytes()[x as usize] {
            b'#' => 255,
            b'?' => 128,
            _ => 0,
        };
        let (width, height) = (rows[0].len() as u32, rows.len() as u32);
        GrayImage::from_fn(width, height, |x, y| Luma([level(x, y)]))
    }

    #[test]
    fn pixels_that_do_not_count_are_left_out() {
        let truth = drawn(&["..?##", "..?##"]);
        let mask = drawn(&[".####", "...##"]);
        let score = score(&mask, &truth, None).unwrap();
        assert!((score.error - 1.0 / 8.0).abs() < 1e-12);
        assert!((score.iou - 4.0 / 5.0).abs() < 1e-12);
    }

    #[test]
    fn the_error_is_that_inside_the_region() {
        let truth = drawn(&["....##", "....##"]);
        let mask = drawn(&["#...##", ".....#"]);
        let score = score(&mask, &truth, Some(Rect::new(2, 0, 4, 2))).unwrap();
        assert!((score.error - 1.0 / 8.0).abs() < 1e-12);
    }

    #[test]
    fn an_edge_two_pixels_away_is_right_and_one_three_away_is_wrong() {
        let image =
            |from: u32| GrayImage::from_fn(20, 6, |x, _| Luma([if x >= from { 255 } else { 0 }]));
        let f = |from| score(&image(from), &image(8), None).unwrap().boundary_f;
        assert!((f(10) - 1.0).abs() < 1e-12);
        assert!(f(11).abs() < 1e-12);
    }

    #[test]
    fn the_middle_of_the_open_band_is_the_edge() {
        let truth = drawn(&["..........????????##########"; 4]);
        let mask =
            |from: u32| GrayImage::from_fn(28, 4, |x, _| Luma([if x >= from { 255 } else { 0 }]));
        assert!(score(&mask(14), &truth, None).unwrap().boundary_f > 0.99);
        assert!(score(&mask(10), &truth, None).unwrap().boundary_f < 0.01);
    }

    #[test]
    fn a_mask_of_another_size_is_refused() {
        let fault = score(&GrayImage::new(3, 3), &GrayImage::new(4, 3), None).unwrap_err();
        assert!(fault.to_string().contains("3 x 3"), "{fault}");
        let open = GrayImage::from_pixel(3, 3, Luma([128]));
        assert_eq!(score(&open, &open, None), Err(ScoreFault::NothingCounts));
    }
}
