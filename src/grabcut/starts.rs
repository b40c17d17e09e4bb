//! Which of two starts gave the better cut of a rectangle: the plain one of GrabCut, or the one that takes half of
//! the rectangle for background at first.
//!
//! The half is right for a rectangle with much background in it, and cuts a part off an object that fills its
//! rectangle and is in places like what is around it. Both cuts are measured by the energy that GrabCut minimises,
//! with histograms in place of its mixtures, because these fit any mask best in closed form (Vicente, Kolmogorov and
//! Rother, "Joint optimization of segmentation and appearance models", 2009). Where a cut reaches all four sides of
//! its rectangle, as the object of a tight one does, the plain start counts as good, and the other has to be better
//! by a margin.

use image::RgbImage;
use relit_data::geometry::Rect;

use super::bitmap::Bitmap;
use super::grab_cut::{DIRECTIONS_AHEAD, SMOOTHNESS, neighbour};
use super::max_flow::DIRECTIONS;

/// Bits of a channel that a histogram distinguishes.
const BITS: usize = 4;
/// Pixels this share of the rectangle's sides around it are looked at.
const AROUND: f64 = 0.3;
/// A cut reaches a side of the rectangle if it comes within this share of the way to the other.
const REACHES: f64 = 0.04;
/// In a tight rectangle the ranked cut has to be better by so much, in units of the log-likelihood of a pixel.
const MARGIN: f64 = 0.2;
/// The longer side of an image at which the margin was chosen, pixels: an outline's share of the pixels falls with
/// the size.
const SIDE: f64 = 600.0;

/// Whether the cut that began with half the rectangle as background is the better one.
pub(super) fn prefers_ranked(
    frame: &RgbImage,
    rect: Rect,
    plain: &Bitmap,
    ranked: &Bitmap,
) -> bool {
    if plain == ranked {
        return false;
    }
    let measure = Measure::new(frame, rect);
    let margin = if fills(plain.bounds(), rect) {
        MARGIN
    } else {
        0.0
    };
    measure.energy(plain) - measure.energy(ranked) > margin
}

/// Whether a cut reaches all four sides of its rectangle.
fn fills(found: Rect, rect: Rect) -> bool {
    let (across, down) = (f64::from(rect.w) * REACHES, f64::from(rect.h) * REACHES);
    f64::from(found.x) - f64::from(rect.x) <= across
        && f64::from(found.y) - f64::from(rect.y) <= down
        && (rect.right() - found.right()) as f64 <= across
        && (rect.bottom() - found.bottom()) as f64 <= down
}

/// An image, as far as cuts in it are measured.
struct Measure<'a> {
    frame: &'a RgbImage,
    size: (usize, usize),
    /// The part in which colours count.
    part: Rect,
    scale: f64,
}

impl<'a> Measure<'a> {
    fn new(frame: &'a RgbImage, rect: Rect) -> Self {
        let (width, height) = frame.dimensions();
        let grow = |side: u32| (f64::from(side) * AROUND) as u32;
        let (dx, dy) = (grow(rect.w), grow(rect.h));
        let part = Rect::new(
            rect.x.saturating_sub_unsigned(dx),
            rect.y.saturating_sub_unsigned(dy),
            rect.w.saturating_add(2 * dx),
            rect.h.saturating_add(2 * dy),
        );
        let mut measure = Self {
            frame,
            size: (width as usize, height as usize),
            part: part.clipped_to(width, height).unwrap_or(rect),
            scale: 0.0,
        };
        let (mut sum, mut count) = (0.0, 0.0);
        measure.pairs(|at, next, _| {
            sum += measure.contrast(at, next);
            count += 1.0;
        });
        measure.scale = 0.5 * f64::max(count, 1.0) / f64::max(sum, 1e-6);
        measure
    }

    /// The energy of a cut, a pixel of the part.
    fn energy(&self, object: &Bitmap) -> f64 {
        let mut histograms = [vec![0_u32; 1 << (3 * BITS)], vec![0_u32; 1 << (3 * BITS)]];
        let (columns, rows) = (
            i64::from(self.part.x)..self.part.right(),
            i64::from(self.part.y)..self.part.bottom(),
        );
        for y in rows {
            for x in columns.clone() {
                let at = y as usize * self.size.0 + x as usize;
                let side = usize::from(object.bits().get(at) == Some(&true));
                histograms[side][self.colour(at)] += 1;
            }
        }
        let colours: f64 = histograms
            .iter()
            .map(|histogram| code_length(histogram))
            .sum();
        let mut outline = 0.0;
        self.pairs(|at, next, length| {
            if object.bits()[at] != object.bits()[next] {
                let alike = (-self.scale * self.contrast(at, next)).exp();
                outline += f64::from(SMOOTHNESS) / length * alike;
            }
        });
        let longer = self.size.0.max(self.size.1) as f64;
        let pixels = f64::from(self.part.w) * f64::from(self.part.h);
        (colours + outline * longer / SIDE) / pixels.max(1.0)
    }

    /// Calls `each` with all pairs of neighbours and their distance.
    fn pairs(&self, mut each: impl FnMut(usize, usize, f64)) {
        for at in 0..self.size.0 * self.size.1 {
            for direction in DIRECTIONS_AHEAD {
                if let Some(next) = neighbour(at, direction, self.size) {
                    let (dx, dy) = DIRECTIONS[direction];
                    let is_diagonal = dx != 0 && dy != 0;
                    each(
                        at,
                        next,
                        if is_diagonal {
                            std::f64::consts::SQRT_2
                        } else {
                            1.0
                        },
                    );
                }
            }
        }
    }

    fn pixel(&self, at: usize) -> &[u8] {
        &self.frame.as_raw()[3 * at..3 * at + 3]
    }

    fn contrast(&self, at: usize, next: usize) -> f64 {
        let pairs = self.pixel(at).iter().zip(self.pixel(next));
        pairs
            .map(|(&a, &b)| (f64::from(a) - f64::from(b)).powi(2))
            .sum()
    }

    fn colour(&self, at: usize) -> usize {
        let bits = self.pixel(at).iter();
        bits.fold(0, |colour, &level| {
            colour << BITS | usize::from(level) >> (8 - BITS)
        })
    }
}

/// The negative log-likelihood of all samples under their own histogram.
fn code_length(histogram: &[u32]) -> f64 {
    let all: f64 = histogram.iter().map(|&count| f64::from(count)).sum();
    let filled = histogram.iter().filter(|&&count| count > 0);
    filled
        .map(|&count| -f64::from(count) * (f64::from(count) / all).ln())
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cut_reaches_a_rectangle_or_not() {
        let rect = Rect::new(10, 10, 100, 50);
        assert!(fills(Rect::new(12, 11, 96, 48), rect));
        assert!(!fills(Rect::new(18, 11, 90, 48), rect));
        assert!(!fills(Rect::new(12, 11, 96, 40), rect));
    }

    #[test]
    fn the_cut_along_the_objects_outline_has_the_least_energy() {
        let inside = |x: u32, y: u32| (20..60).contains(&x) && (16..48).contains(&y);
        let frame = RgbImage::from_fn(80, 64, |x, y| {
            let grain = ((x * 7 + y * 13) % 11) as u8;
            image::Rgb(if inside(x, y) {
                [200 + grain, 90, 40]
            } else {
                [40 + grain, 80, 90]
            })
        });
        let cut = |from: u32, to: u32| {
            Bitmap::new(
                (80, 64),
                (0..80 * 64).map(|at| {
                    let (x, y) = (at % 80, at / 80);
                    inside(x, y) && (from..to).contains(&x)
                }),
            )
        };
        let rect = Rect::new(18, 14, 44, 36);
        let measure = Measure::new(&frame, rect);
        let whole = measure.energy(&cut(20, 60));
        assert!(whole < measure.energy(&cut(20, 40)));
        assert!(!prefers_ranked(&frame, rect, &cut(20, 60), &cut(20, 40)));
        assert!(prefers_ranked(&frame, rect, &cut(20, 40), &cut(20, 60)));
    }
}
