//! Statistics of the pixels of an image, all of them or those under a mask: saturation, mean colour,
//! sharpness. Knows images and nothing of files.
//!
//! Everything is summed in integers, so the figures are exact and do not depend on the machine or on
//! the order of the work: they can be compared for equality when a data set is read back.

use std::ops::Range;

use image::{GrayImage, Luma, RgbImage};

/// The 8-bit value from which a channel counts as saturated, where nobody asks for another.
///
/// The paper (section "Specularity separation") counts saturated pixels and gives no value: 250 is this
/// project's.
pub const SATURATION_LEVEL: u8 = 250;

/// [`SATURATION_LEVEL`] as a part of white, less half a step: a value of a file with more bits, which would be rounded to
/// that level, is saturated too.
pub const SATURATED_VALUE: f32 = (SATURATION_LEVEL as f32 - 0.5) / 255.0;

/// An image of another size than the mask that it is measured under.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the image is {}x{} pixels, but {}x{} were expected", size[0], size[1], expected[0], expected[1])]
pub struct SizeMismatch {
    /// Width and height of the image, pixels.
    pub size: [u32; 2],
    /// Width and height of the mask, pixels.
    pub expected: [u32; 2],
}

/// Luma of a pixel in thousandths of a grey level, 0..=255 000.
#[inline(always)]
fn luma([r, g, b]: [u32; 3]) -> i32 {
    (299 * r + 587 * g + 114 * b) as i32
}

/// Statistics of one image under one mask.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measures {
    /// Pixels under the mask.
    pub mask_px: u64,
    /// Pixels under the mask with all three channels at or above the level.
    pub saturated_px: u64,
    /// Pixels under the mask with any channel at or above the level.
    pub saturated_any_px: u64,
    /// Mean red, green and blue under the mask, 0..=255; 0 if the mask is empty.
    pub mean_rgb: [f64; 3],
    /// Population variance of the Laplacian (4 neighbours) of luma, over the pixels that are under
    /// the mask together with their four neighbours; luma = 0.299 R + 0.587 G + 0.114 B, 0..=255.
    /// 0 without such pixels.
    pub sharpness: f64,
}

impl Measures {
    /// `saturated_px / mask_px`, 0..=1; 0 if the mask is empty.
    pub fn saturated_fraction(&self) -> f64 {
        fraction(self.saturated_px, self.mask_px)
    }
}

/// `part / whole`, or 0 if `whole` is 0.
pub fn fraction(part: u64, whole: u64) -> f64 {
    if whole == 0 {
        0.0
    } else {
        part as f64 / whole as f64
    }
}

/// Measures all pixels of `image`; `level` is the saturation level, 0..=255.
pub fn measure_whole(image: &RgbImage, level: u8) -> Measures {
    let whole = GrayImage::from_pixel(image.width(), image.height(), Luma([255]));
    MaskSpans::from_mask(&whole).sum(image, level)
}

/// Part of a row: columns.
type Span = Range<usize>;

/// A mask prepared for measuring many images, as runs of pixels in each row.
#[derive(Debug, Clone)]
pub struct MaskSpans {
    width: u32,
    height: u32,
    /// Runs under the mask, row by row.
    rows: Vec<Vec<Span>>,
    /// Runs of pixels that are under the mask with all four neighbours, row by row.
    inner: Vec<Vec<Span>>,
    pixels: u64,
}

impl MaskSpans {
    /// The runs of `mask`, in which values of 128 and above are the object.
    pub fn from_mask(mask: &GrayImage) -> Self {
        let (width, height) = mask.dimensions();
        let under: Vec<Vec<bool>> = mask
            .rows()
            .map(|row| row.map(|pixel| pixel.0[0] >= 128).collect())
            .collect();
        let rows: Vec<Vec<Span>> = under.iter().map(|row| runs(row)).collect();
        let inner = (0..under.len())
            .map(|y| runs(&inner_row(&under, y)))
            .collect();
        Self {
            width,
            height,
            pixels: pixels_of(&rows),
            rows,
            inner,
        }
    }

    /// The same mask, limited to the columns and rows of the image that show what was seen.
    ///
    /// ```
    /// use image::{GrayImage, Luma, RgbImage};
    /// use relit_data::image_stats::MaskSpans;
    ///
    /// let spans = MaskSpans::from_mask(&GrayImage::from_pixel(9, 6, Luma([255])));
    /// let seen = spans.within(0..9, 2..6);
    /// assert_eq!(seen.measure(&RgbImage::new(9, 6), 250).unwrap().mask_px, 36);
    /// ```
    pub fn within(&self, columns: Range<u32>, rows: Range<u32>) -> Self {
        let inside = |all: &[Vec<Span>], by: usize| -> Vec<Vec<Span>> {
            let seen = |range: &Range<u32>| {
                range.start as usize + by..(range.end as usize).saturating_sub(by)
            };
            let (columns, rows) = (seen(&columns), seen(&rows));
            let cut = |span: &Span| {
                let (start, end) = (span.start.max(columns.start), span.end.min(columns.end));
                (start < end).then_some(start..end)
            };
            let row = |(y, spans): (usize, &Vec<Span>)| {
                let spans = if rows.contains(&y) {
                    spans.as_slice()
                } else {
                    &[]
                };
                spans.iter().filter_map(cut).collect()
            };
            all.iter().enumerate().map(row).collect()
        };
        let rows_under = inside(&self.rows, 0);
        Self {
            width: self.width,
            height: self.height,
            pixels: pixels_of(&rows_under),
            rows: rows_under,
            // The neighbours must have been seen, too.
            inner: inside(&self.inner, 1),
        }
    }

    /// Width and height of the mask, pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// Number of pixels under the mask.
    pub fn pixels(&self) -> u64 {
        self.pixels
    }

    /// Measures `image`; `level` is the saturation level, 0..=255 (250 by default in the tools).
    /// Pixels outside the mask have no influence.
    ///
    /// # Errors
    /// [`SizeMismatch`] if image and mask differ in size.
    pub fn measure(&self, image: &RgbImage, level: u8) -> Result<Measures, SizeMismatch> {
        self.check_size(image)?;
        Ok(self.sum(image, level))
    }

    fn sum(&self, image: &RgbImage, level: u8) -> Measures {
        let row_bytes = self.width as usize * 3;
        let mut measuring = self.measuring(level);
        for row in image.as_raw().chunks_exact(row_bytes.max(3)) {
            measuring.add_row::<3>(row);
        }
        measuring.finish()
    }

    /// Starts measuring an image that comes row by row.
    pub fn measuring(&self, level: u8) -> Measuring<'_> {
        Measuring {
            spans: self,
            level: u32::from(level),
            rows: 0,
            total: Counts::default(),
            laplacian: Laplacian::new(self.width as usize),
        }
    }

    /// The first pixel (x, y) outside the mask that is not black, if there is one.
    ///
    /// # Errors
    /// [`SizeMismatch`] if image and mask differ in size.
    pub fn first_lit_outside(&self, image: &RgbImage) -> Result<Option<(u32, u32)>, SizeMismatch> {
        self.check_size(image)?;
        let row_bytes = self.width as usize * 3;
        let rows = image.as_raw().chunks_exact(row_bytes.max(3));
        for ((row, spans), y) in rows.zip(&self.rows).zip(0_u32..) {
            let ends = spans.iter().map(|span| span.end);
            let starts = spans.iter().map(|span| span.start);
            let outside = std::iter::once(0)
                .chain(ends)
                .zip(starts.chain([self.width as usize]));
            for (start, end) in outside {
                let pixels = row.get(start * 3..end * 3).unwrap_or_default();
                if let Some(at) = pixels.iter().position(|&value| value != 0) {
                    let x = u32::try_from(start + at / 3).unwrap_or(u32::MAX);
                    return Ok(Some((x, y)));
                }
            }
        }
        Ok(None)
    }

    fn check_size(&self, image: &RgbImage) -> Result<(), SizeMismatch> {
        let size = [image.width(), image.height()];
        if size == self.size() {
            Ok(())
        } else {
            Err(SizeMismatch {
                size,
                expected: self.size(),
            })
        }
    }
}

fn pixels_of(rows: &[Vec<Span>]) -> u64 {
    let spans = rows.iter().flatten();
    spans.map(|span| (span.end - span.start) as u64).sum()
}

/// The runs of true values in a row.
fn runs(row: &[bool]) -> Vec<Span> {
    let mut spans = Vec::new();
    let mut start = None;
    for (x, &under) in row.iter().chain([&false]).enumerate() {
        match (start, under) {
            (None, true) => start = Some(x),
            (Some(from), false) => {
                spans.push(from..x);
                start = None;
            }
            _ => {}
        }
    }
    spans
}

/// For each pixel of row `y`, whether it is under the mask with all four neighbours.
fn inner_row(under: &[Vec<bool>], y: usize) -> Vec<bool> {
    let at = |x: usize, y: usize| under.get(y).and_then(|row| row.get(x)).is_some_and(|&u| u);
    let width = under.get(y).map_or(0, Vec::len);
    (0..width)
        .map(|x| {
            at(x, y)
                && at(x + 1, y)
                && at(x, y + 1)
                && x.checked_sub(1).is_some_and(|left| at(left, y))
                && y.checked_sub(1).is_some_and(|above| at(x, above))
        })
        .collect()
}

/// Measures an image row by row, under the mask of [`MaskSpans`].
#[derive(Debug)]
pub struct Measuring<'a> {
    spans: &'a MaskSpans,
    level: u32,
    rows: usize,
    total: Counts,
    laplacian: Laplacian,
}

impl Measuring<'_> {
    /// Adds the next row: `BYTES` bytes a pixel, first red, green and blue.
    /// What lies beyond the mask's size does not count.
    // Compiled into the caller, which knows the processor's vector instructions.
    #[inline(always)]
    pub fn add_row<const BYTES: usize>(&mut self, row: &[u8]) {
        for span in self.spans.rows.get(self.rows).into_iter().flatten() {
            let pixels = row.get(span.start * BYTES..span.end * BYTES);
            self.total
                .add::<BYTES>(pixels.unwrap_or_default(), self.level);
        }
        self.laplacian.add_row::<BYTES>(row, self.rows, self.spans);
        self.rows += 1;
    }

    /// The measures of the rows so far.
    pub fn finish(self) -> Measures {
        let pixels = self.spans.pixels;
        Measures {
            mask_px: pixels,
            saturated_px: self.total.all,
            saturated_any_px: self.total.any,
            mean_rgb: self.total.sums.map(|sum| fraction(sum, pixels)),
            sharpness: self.laplacian.variance(),
        }
    }
}

/// Red, green and blue of a pixel.
#[inline(always)]
fn channels<const BYTES: usize>(pixel: &[u8]) -> [u32; 3] {
    match pixel {
        // One load of the four bytes becomes vector instructions.
        &[r, g, b, x] => {
            let all = u32::from_le_bytes([r, g, b, x]);
            [all & 255, (all >> 8) & 255, (all >> 16) & 255]
        }
        _ => [pixel[0], pixel[1], pixel[2]].map(u32::from),
    }
}

/// Sums over runs of pixels.
#[derive(Debug, Default)]
struct Counts {
    sums: [u64; 3],
    all: u64,
    any: u64,
}

impl Counts {
    /// Adds a run of pixels, in short pieces so that the inner loop needs 32 bits only and can be
    /// vectorised.
    #[inline(always)]
    fn add<const BYTES: usize>(&mut self, pixels: &[u8], level: u32) {
        for piece in pixels.chunks(BYTES * 4096) {
            let [mut red, mut green, mut blue] = [0_u32; 3];
            let (mut all, mut any) = (0_u32, 0_u32);
            for pixel in piece.chunks_exact(BYTES) {
                let [r, g, b] = channels::<BYTES>(pixel);
                red += r;
                green += g;
                blue += b;
                all += u32::from(r.min(g).min(b) >= level);
                any += u32::from(r.max(g).max(b) >= level);
            }
            for (sum, part) in self.sums.iter_mut().zip([red, green, blue]) {
                *sum += u64::from(part);
            }
            self.all += u64::from(all);
            self.any += u64::from(any);
        }
    }
}

/// Sums of the Laplacian over an image that is added row by row; holds three rows of luma.
#[derive(Debug)]
struct Laplacian {
    above: Vec<i32>,
    here: Vec<i32>,
    below: Vec<i32>,
    count: u64,
    sum: i64,
    squares: u128,
}

impl Laplacian {
    fn new(width: usize) -> Self {
        let row = vec![0; width];
        Self {
            above: row.clone(),
            here: row.clone(),
            below: row,
            count: 0,
            sum: 0,
            squares: 0,
        }
    }

    /// Adds row `y`. The Laplacian of the row above is then complete, and is summed over that row's
    /// runs of inner pixels, whose neighbours are all under the mask: luma is not needed elsewhere.
    #[inline(always)]
    fn add_row<const BYTES: usize>(&mut self, row: &[u8], y: usize, spans: &MaskSpans) {
        std::mem::swap(&mut self.above, &mut self.here);
        std::mem::swap(&mut self.here, &mut self.below);
        for span in spans.rows.get(y).into_iter().flatten() {
            let pixels = row.get(span.start * BYTES..span.end * BYTES);
            let below = self.below.get_mut(span.start..span.end);
            let pixels = pixels.unwrap_or_default().chunks_exact(BYTES);
            for (value, pixel) in below.unwrap_or_default().iter_mut().zip(pixels) {
                *value = luma(channels::<BYTES>(pixel));
            }
        }
        let inner = y.checked_sub(1).and_then(|above| spans.inner.get(above));
        for span in inner.into_iter().flatten() {
            self.add_span(span.start, span.end);
        }
    }

    #[inline(always)]
    fn add_span(&mut self, start: usize, end: usize) {
        // An inner pixel has a left and a right neighbour, so the slices exist.
        let (Some(above), Some(left), Some(here), Some(right), Some(below)) = (
            self.above.get(start..end),
            start
                .checked_sub(1)
                .and_then(|left| self.here.get(left..end - 1)),
            self.here.get(start..end),
            self.here.get(start + 1..end + 1),
            self.below.get(start..end),
        ) else {
            return;
        };
        // Pieces whose sums need 32 and 64 bits only.
        let length = end - start;
        for from in (0..length).step_by(1024) {
            let piece = from..length.min(from + 1024);
            let (mut sum, mut squares) = (0_i32, 0_u64);
            let around = above[piece.clone()].iter().zip(&left[piece.clone()]);
            let around = around.zip(&right[piece.clone()]).zip(&below[piece.clone()]);
            for ((((a, l), r), b), h) in around.zip(&here[piece]) {
                let value = 4 * h - a - l - r - b;
                let magnitude = u64::from(value.unsigned_abs());
                sum += value;
                squares += magnitude * magnitude;
            }
            self.sum += i64::from(sum);
            self.squares += u128::from(squares);
        }
        self.count += length as u64;
    }

    /// Population variance in squared grey levels (the sums are in thousandths of a level).
    fn variance(&self) -> f64 {
        if self.count == 0 {
            return 0.0;
        }
        let count = u128::from(self.count);
        let sum = u128::from(self.sum.unsigned_abs());
        let scaled = (count * self.squares).saturating_sub(sum * sum);
        scaled as f64 / (count * count) as f64 / 1e6
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;
    use proptest::prelude::*;

    /// The definition, pixel by pixel.
    fn by_definition(image: &RgbImage, mask: &GrayImage, level: u8) -> Measures {
        let (w, h) = image.dimensions();
        let under = |x: i64, y: i64| {
            (0..i64::from(w)).contains(&x)
                && (0..i64::from(h)).contains(&y)
                && mask.get_pixel(x as u32, y as u32).0[0] >= 128
        };
        let luma_at = |x: i64, y: i64| {
            let [r, g, b] = image.get_pixel(x as u32, y as u32).0;
            i128::from(299 * u32::from(r) + 587 * u32::from(g) + 114 * u32::from(b))
        };
        let (mut px, mut all, mut any, mut sums) = (0, 0, 0, [0_u64; 3]);
        let mut laplacians = Vec::new();
        for y in 0..i64::from(h) {
            for x in 0..i64::from(w) {
                if !under(x, y) {
                    continue;
                }
                let rgb = image.get_pixel(x as u32, y as u32).0;
                px += 1;
                all += u64::from(rgb.iter().all(|&v| v >= level));
                any += u64::from(rgb.iter().any(|&v| v >= level));
                for (sum, v) in sums.iter_mut().zip(rgb) {
                    *sum += u64::from(v);
                }
                let around = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)];
                if around.iter().all(|&(x, y)| under(x, y)) {
                    let sides: i128 = around.iter().map(|&(x, y)| luma_at(x, y)).sum();
                    laplacians.push(4 * luma_at(x, y) - sides);
                }
            }
        }
        let n = laplacians.len() as i128;
        let sum: i128 = laplacians.iter().sum();
        let squares: i128 = laplacians.iter().map(|v| v * v).sum();
        let sharpness = if n == 0 {
            0.0
        } else {
            (n * squares - sum * sum) as f64 / (n * n) as f64 / 1e6
        };
        Measures {
            mask_px: px,
            saturated_px: all,
            saturated_any_px: any,
            mean_rgb: sums.map(|s| fraction(s, px)),
            sharpness,
        }
    }

    fn images() -> impl Strategy<Value = (RgbImage, GrayImage)> {
        (1_u32..14, 1_u32..14).prop_flat_map(|(w, h)| {
            let n = (w * h) as usize;
            let pixels = prop::collection::vec(any::<u8>(), 3 * n);
            let mask = prop::collection::vec(prop::sample::select(vec![0, 255, 255, 255_u8]), n);
            (pixels, mask).prop_map(move |(pixels, mask)| {
                let image = RgbImage::from_raw(w, h, pixels).unwrap();
                (image, GrayImage::from_raw(w, h, mask).unwrap())
            })
        })
    }

    proptest! {
        #[test]
        fn the_figures_are_those_of_the_definition((image, mask) in images(), level in 100_u8..) {
            let measured = MaskSpans::from_mask(&mask).measure(&image, level).unwrap();
            prop_assert_eq!(measured, by_definition(&image, &mask, level));
        }

        #[test]
        fn a_whole_image_is_measured_as_under_a_mask_of_everything((image, _) in images()) {
            let everything = GrayImage::from_pixel(image.width(), image.height(), Luma([255]));
            prop_assert_eq!(measure_whole(&image, 250), by_definition(&image, &everything, 250));
        }

        #[test]
        fn pixels_outside_the_mask_have_no_influence((image, mask) in images()) {
            let spans = MaskSpans::from_mask(&mask);
            let mut masked = image.clone();
            for (pixel, m) in masked.pixels_mut().zip(mask.pixels()) {
                if m.0[0] == 0 {
                    *pixel = Rgb([0; 3]);
                }
            }
            prop_assert_eq!(spans.measure(&image, 250).unwrap(), spans.measure(&masked, 250).unwrap());
            prop_assert_eq!(spans.first_lit_outside(&masked).unwrap(), None);
        }
    }

    #[test]
    fn a_lit_pixel_outside_the_mask_is_found_at_its_position() {
        let mask = GrayImage::from_fn(6, 4, |x, _| Luma([if x == 2 { 255 } else { 0 }]));
        for at in [(0, 0), (1, 2), (3, 3), (5, 1)] {
            let mut image = RgbImage::new(6, 4);
            image.put_pixel(2, 1, Rgb([9; 3]));
            image.put_pixel(at.0, at.1, Rgb([0, 0, 1]));
            let found = MaskSpans::from_mask(&mask)
                .first_lit_outside(&image)
                .unwrap();
            assert_eq!(found, Some(at));
        }
    }

    #[test]
    fn a_flat_image_has_no_sharpness() {
        let image = RgbImage::from_pixel(9, 9, Rgb([250, 251, 10]));
        let full = MaskSpans::from_mask(&GrayImage::from_pixel(9, 9, Luma([255])));
        let measures = full.measure(&image, 250).unwrap();
        assert_eq!(measures.sharpness, 0.0);
        assert_eq!((measures.saturated_px, measures.saturated_any_px), (0, 81));
        assert_eq!(measures.mean_rgb, [250.0, 251.0, 10.0]);
    }

    #[test]
    fn an_empty_mask_has_no_figures() {
        let image = RgbImage::from_pixel(9, 9, Rgb([250, 251, 10]));
        let empty = MaskSpans::from_mask(&GrayImage::new(9, 9))
            .measure(&image, 250)
            .unwrap();
        assert_eq!((empty.mask_px, empty.saturated_fraction()), (0, 0.0));
    }

    #[test]
    fn a_sharp_edge_has_a_greater_figure_than_a_soft_one() {
        let sharpness = |period: u32| {
            let stripes = RgbImage::from_fn(16, 16, |x, _| {
                let distance = (x % (2 * period)).abs_diff(period) * 255 / period;
                Rgb([distance as u8; 3])
            });
            measure_whole(&stripes, 250).sharpness
        };
        assert!(sharpness(1) > 4.0 * sharpness(4));
        assert_eq!(
            measure_whole(&RgbImage::new(0, 0), 250).saturated_fraction(),
            0.0
        );
    }

    #[test]
    fn an_image_of_another_size_is_refused() {
        let spans = MaskSpans::from_mask(&GrayImage::new(4, 4));
        assert!(spans.measure(&RgbImage::new(4, 5), 250).is_err());
        assert!(
            MaskSpans::from_mask(&GrayImage::new(0, 0))
                .measure(&RgbImage::new(0, 0), 0)
                .is_ok()
        );
    }
}
