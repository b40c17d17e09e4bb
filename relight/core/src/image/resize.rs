//! Images in another size, and values beyond the edge of a mask.

use std::ops::Range;

use super::{Extent, Planes};

/// A rectangle of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Size of the whole image.
    pub whole: Extent,
    /// Column and row of the rectangle's first pixel in it.
    pub at: [i64; 2],
    /// Size of the rectangle.
    pub extent: Extent,
}

impl Part {
    /// All of an image.
    pub const fn all(whole: Extent) -> Self {
        Self {
            whole,
            at: [0; 2],
            extent: whole,
        }
    }
}

impl<const C: usize> Planes<C> {
    /// The image in another size. Where it becomes smaller, each pixel is the mean of the area that it
    /// covers; where it becomes larger, it is interpolated linearly between the pixels' middles.
    pub fn resized(&self, extent: Extent) -> Self {
        if extent == self.extent() {
            return self.clone();
        }
        self.resized_part(&Part::all(self.extent()), &Part::all(extent))
    }

    /// Resamples this image, which is the part `source` of a larger one, to the part `target` of that image in another size.
    /// Outside `source` the larger image is 0.
    ///
    /// # Panics
    /// Where this has another size than `source`, or `target` reaches beyond its image.
    pub fn resized_part(&self, source: &Part, target: &Part) -> Self {
        assert_eq!(source.extent, self.extent(), "size of the part");
        let (from, extent) = (self.extent(), target.extent);
        let line = |axis: usize, size: fn(Extent) -> usize| -> Vec<Vec<(usize, f32)>> {
            let all = taps(size(source.whole), size(target.whole));
            let first = usize::try_from(target.at[axis]).unwrap_or(usize::MAX);
            let given = |&(at, share): &(usize, f32)| {
                let at = usize::try_from(at as i64 - source.at[axis]).ok()?;
                (at < size(from)).then_some((at, share))
            };
            let within = all[first..][..size(extent)].iter();
            within
                .map(|taps| taps.iter().filter_map(given).collect())
                .collect()
        };
        let across = line(0, |extent| extent.width);
        let down = line(1, |extent| extent.height);
        let mut wide = Self::zeros(Extent::new(extent.width, from.height));
        wide.fill_rows(|y, row| {
            for (out, plane) in row.into_iter().zip(self.planes()) {
                let line = &plane[y * from.width..][..from.width];
                for (value, taps) in out.iter_mut().zip(&across) {
                    *value = taps.iter().map(|&(at, share)| share * line[at]).sum();
                }
            }
        });
        let mut resized = Self::zeros(extent);
        resized.fill_rows(|y, row| {
            for (out, plane) in row.into_iter().zip(wide.planes()) {
                for &(at, share) in &down[y] {
                    let line = &plane[at * extent.width..][..extent.width];
                    for (sum, value) in out.iter_mut().zip(line) {
                        *sum += share * value;
                    }
                }
            }
        });
        resized
    }

    /// The image with its columns in reverse order.
    #[must_use]
    pub fn mirrored(mut self) -> Self {
        let width = self.extent().width.max(1);
        for plane in self.planes_mut() {
            plane.chunks_exact_mut(width).for_each(<[f32]>::reverse);
        }
        self
    }

    /// The image in which each pixel that is wanted and not `known` has the values of a nearest pixel
    /// that is known and reached over wanted pixels; the others stay.
    ///
    /// # Panics
    /// Where `known` or `wanted` are not as long as the image has pixels.
    #[must_use]
    pub fn extended(mut self, known: &[bool], wanted: &[bool]) -> Self {
        let extent = self.extent();
        assert_eq!(known.len(), extent.pixels(), "pixels that are known");
        assert_eq!(wanted.len(), extent.pixels(), "pixels that are wanted");
        let mut known = known.to_vec();
        let mut front: Vec<usize> = (0..known.len()).filter(|&at| known[at]).collect();
        while !front.is_empty() {
            let mut next = Vec::new();
            for at in front {
                for other in beside(extent, at).into_iter().flatten() {
                    if !known[other] && wanted[other] {
                        known[other] = true;
                        for plane in self.planes_mut() {
                            plane[other] = plane[at];
                        }
                        next.push(other);
                    }
                }
            }
            front = next;
        }
        self
    }
}

/// The pixels on the four sides of a pixel, as far as there are any.
pub fn beside(extent: Extent, at: usize) -> [Option<usize>; 4] {
    let Extent { width, height } = extent;
    let (x, y) = (at % width, at / width);
    [
        (x > 0).then(|| at - 1),
        (x + 1 < width).then_some(at + 1),
        (y > 0).then(|| at - width),
        (y + 1 < height).then_some(at + width),
    ]
}

/// The open pixels that are reached from one over their sides; they are closed then.
pub fn reached(extent: Extent, from: usize, open: &mut [bool]) -> Vec<usize> {
    let mut found = Vec::new();
    let mut reach = |at: usize, found: &mut Vec<usize>| {
        if std::mem::take(&mut open[at]) {
            found.push(at);
        }
    };
    reach(from, &mut found);
    let mut next = 0;
    while let Some(&at) = found.get(next) {
        next += 1;
        for other in beside(extent, at).into_iter().flatten() {
            reach(other, &mut found);
        }
    }
    found
}

/// The parts of the open pixels that hang together, in the order of their first pixels.
pub fn connected_parts(extent: Extent, mut open: Vec<bool>) -> Vec<Vec<usize>> {
    (0..open.len())
        .map(|at| reached(extent, at, &mut open))
        .filter(|part| !part.is_empty())
        .collect()
}

/// For each of `to` pixels of a line: the source pixels of a line of `from`, with weights.
fn taps(from: usize, to: usize) -> Vec<Vec<(usize, f32)>> {
    if to <= from {
        let single = |(at, share): (usize, f64)| (at, share as f32);
        return area_shares(from, to)
            .into_iter()
            .map(|part| part.into_iter().map(single).collect())
            .collect();
    }
    let last = from.saturating_sub(1);
    let tap = |at: usize| {
        let place = (at as f64 + 0.5) * from as f64 / to as f64 - 0.5;
        let place = place.clamp(0.0, last as f64);
        let first = (place as usize).min(last);
        let share = (place - first as f64) as f32;
        vec![(first, 1.0 - share), ((first + 1).min(last), share)]
    };
    (0..to).map(tap).collect()
}

/// For each of `to` equal parts of a line of `from` pixels: the pixels in it and their shares.
pub(crate) fn area_shares(from: usize, to: usize) -> Vec<Vec<(usize, f64)>> {
    let part = |at: usize| {
        // In units of 1 / to of a pixel, so that nothing is rounded.
        let (start, end) = (at * from, (at + 1) * from);
        let pixels: Range<usize> = start / to..end.div_ceil(to);
        let covered = move |pixel: usize| end.min((pixel + 1) * to) - start.max(pixel * to);
        pixels
            .map(move |pixel| (pixel, covered(pixel) as f64 / from as f64))
            .collect()
    };
    (0..to).map(part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(extent: Extent) -> Planes<2> {
        Planes::from_fn(extent, |x, y| [x as f32, 10.0 * y as f32])
    }

    #[test]
    fn the_shares_of_a_pixel_sum_up_to_one() {
        for (from, to) in [(512, 200), (3, 7), (5, 5), (1, 4)] {
            for part in area_shares(from, to) {
                let sum: f64 = part.iter().map(|(_, share)| share).sum();
                assert!((sum - 1.0).abs() < 1e-12, "{from} {to} {part:?}");
            }
            for part in taps(from, to) {
                let sum: f32 = part.iter().map(|(_, share)| share).sum();
                assert!((sum - 1.0).abs() < 1e-6, "{from} {to} {part:?}");
            }
        }
    }

    #[test]
    fn a_smaller_image_has_means_of_areas_and_a_larger_one_lines_between_middles() {
        let small = ramp(Extent::new(8, 6)).resized(Extent::new(4, 2));
        assert_eq!(small.pixel(0, 0), [0.5, 10.0]);
        assert_eq!(small.pixel(3, 1), [6.5, 40.0]);
        let large = ramp(Extent::new(4, 2)).resized(Extent::new(8, 4));
        assert_eq!(large.pixel(0, 0), [0.0, 0.0]);
        assert_eq!(large.pixel(3, 1), [1.25, 2.5]);
        assert_eq!(large.pixel(7, 3), [3.0, 10.0]);
    }

    #[test]
    fn a_part_in_another_size_is_that_part_of_all_in_another_size() {
        let whole = Extent::new(24, 18);
        // What is given reaches beyond the image on the left, and is not all of it.
        let source = Part {
            whole,
            at: [-3, 2],
            extent: Extent::new(20, 11),
        };
        let given = ramp(source.extent).map(|value| value + 1.0);
        let full = Planes::from_fn(whole, |x, y| match (x + 3, y.checked_sub(2)) {
            (x, Some(y)) if x < 20 && y < 11 => given.pixel(x, y),
            _ => [0.0; 2],
        });
        for extent in [whole, Extent::new(7, 5), Extent::new(60, 50)] {
            let all = full.resized(extent);
            let target = Part {
                whole: extent,
                at: [2, 1],
                extent: Extent::new(extent.width - 3, extent.height - 2),
            };
            let part = given.resized_part(&source, &target);
            for y in 0..target.extent.height {
                for x in 0..target.extent.width {
                    let (found, wanted) = (part.pixel(x, y), all.pixel(x + 2, y + 1));
                    let apart = (0..2).map(|c| (found[c] - wanted[c]).abs());
                    assert!(apart.fold(0.0, f32::max) < 1e-4, "{found:?} {wanted:?}");
                }
            }
        }
    }

    #[test]
    fn a_mirrored_image_has_its_first_column_last() {
        let extent = Extent::new(4, 2);
        let mirrored = ramp(extent).mirrored();
        assert_eq!(mirrored.pixel(3, 1), [0.0, 10.0]);
        assert_eq!(mirrored.mirrored(), ramp(extent));
    }

    #[test]
    fn unknown_pixels_have_the_values_of_their_nearest_known_neighbour() {
        let extent = Extent::new(5, 1);
        let known = [false, true, false, false, true];
        let wanted = [false, true, true, true, true];
        let full = ramp(extent).extended(&known, &wanted);
        assert_eq!(full.plane(0), [0.0, 1.0, 1.0, 4.0, 4.0]);
    }
}
