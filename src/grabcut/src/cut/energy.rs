//! How good a cut is by the energy that GrabCut minimises, so that cuts from different starts can be compared.
//!
//! In place of GrabCut's mixtures it has histograms, because these fit any mask best in closed form (Vicente,
//! Kolmogorov and Rother, "Joint optimization of segmentation and appearance models", 2009).

use image::RgbImage;
use relit_data::geometry::Rect;

use super::grab_cut::{DIRECTIONS_AHEAD, SMOOTHNESS, neighbour};
use super::max_flow::DIRECTIONS;
use crate::bitmap::Bitmap;

/// Bits of a channel that a histogram distinguishes.
const BITS: usize = 4;
/// Pixels this share of the rectangle's sides around it are looked at.
const AROUND: f64 = 0.3;
/// The longer side of an image at which energies are compared, pixels: an outline's share of the pixels falls with the
/// size.
const SIDE: f64 = 600.0;

/// An image, as far as cuts in it are measured.
pub(crate) struct CutEnergy<'a> {
    frame: &'a RgbImage,
    size: (usize, usize),
    /// The part in which colours count.
    part: Rect,
    scale: f64,
}

impl<'a> CutEnergy<'a> {
    pub(crate) fn new(frame: &'a RgbImage, rect: Rect) -> Self {
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

    /// The energy of a cut, in units of the log-likelihood of a pixel of the part.
    pub(crate) fn of(&self, object: &Bitmap) -> f64 {
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
        let measure = CutEnergy::new(&frame, rect);
        let whole = measure.of(&cut(20, 60));
        assert!(whole < measure.of(&cut(20, 40)));
        assert!(whole < measure.of(&cut(30, 60)));
    }
}
