//! The brightness of pictures, and of half of them, where it is needed.

use std::ops::Range;

use image::GrayImage;
use pulp::{Arch, Simd, WithSimd};

use super::region::Region;
use crate::CropView;

/// Brightness of these rows of a picture where it is needed, 0..=255; `grey` takes the picture's size.
pub(super) fn luma(
    picture: CropView<'_>,
    rows: Range<usize>,
    needed: &Region,
    grey: &mut GrayImage,
) {
    resize(grey, picture.dimensions());
    Arch::new().dispatch(Whole {
        picture,
        rows,
        needed,
        grey,
    });
}

/// The brightness of half the picture, each pixel the mean of two by two, as far as these rows of the picture tell it;
/// those before them are known.
pub(super) fn half_luma(
    picture: CropView<'_>,
    rows: Range<usize>,
    needed: &Region,
    grey: &mut GrayImage,
) {
    let (width, height) = picture.dimensions();
    resize(grey, (width / 2, height / 2));
    Arch::new().dispatch(HalfOfPicture {
        picture,
        rows: rows.start / 2..rows.end / 2,
        needed,
        grey,
    });
}

/// Half the picture: means of two by two pixels.
pub(super) fn half(image: &GrayImage, needed: &Region, small: &mut GrayImage) {
    resize(small, (image.width() / 2, image.height() / 2));
    Arch::new().dispatch(HalfOfGrey {
        image,
        needed,
        small,
    });
}

fn resize(image: &mut GrayImage, (width, height): (u32, u32)) {
    if image.dimensions() != (width, height) {
        *image = GrayImage::new(width, height);
    }
}

/// These rows of a picture with the columns of each that are needed.
fn parts<'a>(
    image: &'a mut GrayImage,
    rows: Range<usize>,
    needed: &'a Region,
) -> impl Iterator<Item = (usize, Range<usize>, &'a mut [u8])> {
    let width = (image.width() as usize).max(1);
    let all = image.as_flat_samples_mut().samples.chunks_exact_mut(width);
    let rows = all.enumerate().take(rows.end).skip(rows.start);
    rows.filter_map(|(y, row)| {
        let columns = needed.row(y);
        let part = row.get_mut(columns.clone())?;
        Some((y, columns, part)).filter(|(_, columns, _)| !columns.is_empty())
    })
}

/// These loops are compiled for the kind of processor.
struct Whole<'a> {
    picture: CropView<'a>,
    rows: Range<usize>,
    needed: &'a Region,
    grey: &'a mut GrayImage,
}

impl WithSimd for Whole<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (y, columns, to) in parts(self.grey, self.rows, self.needed) {
            let row = self.picture.row(y as i64, 0);
            let pixels = row.get(4 * columns.start..4 * columns.end);
            for (to, pixel) in to
                .iter_mut()
                .zip(pixels.unwrap_or_default().chunks_exact(4))
            {
                *to = (sum_of(pixel) >> 8) as u8;
            }
        }
    }
}

struct HalfOfPicture<'a> {
    picture: CropView<'a>,
    /// Of the half.
    rows: Range<usize>,
    needed: &'a Region,
    grey: &'a mut GrayImage,
}

impl WithSimd for HalfOfPicture<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (y, columns, to) in parts(self.grey, self.rows, self.needed) {
            let row = |y: usize| {
                let row = self.picture.row(y as i64, 0);
                let pixels = row.get(8 * columns.start..8 * columns.end);
                pixels.unwrap_or_default().as_chunks::<8>().0
            };
            for ((to, above), below) in to.iter_mut().zip(row(2 * y)).zip(row(2 * y + 1)) {
                // Every other byte of two pixels, with room for the sums.
                let [above, below] = [above, below].map(|two| u64::from_le_bytes(*two));
                let every_other = |two: u64| two & 0x00ff_00ff_00ff_00ff;
                let red_blue = every_other(above) + every_other(below);
                let green = every_other(above >> 8) + every_other(below >> 8);
                let [red_blue, green] = [red_blue, green].map(|two| (two + (two >> 32)) as u32);
                let [red, green, blue] = [red_blue & 0xffff, green & 0xffff, red_blue >> 16];
                *to = (weighed([red, green, blue]) >> 10) as u8;
            }
        }
    }
}

/// 256 times a pixel's brightness.
#[inline(always)]
fn sum_of(pixel: &[u8]) -> u32 {
    let all = u32::from_le_bytes([pixel[0], pixel[1], pixel[2], pixel[3]]);
    weighed([all & 255, (all >> 8) & 255, (all >> 16) & 255])
}

#[inline(always)]
fn weighed([red, green, blue]: [u32; 3]) -> u32 {
    77 * red + 150 * green + 29 * blue
}

struct HalfOfGrey<'a> {
    image: &'a GrayImage,
    needed: &'a Region,
    small: &'a mut GrayImage,
}

impl WithSimd for HalfOfGrey<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let source = self.image.width() as usize;
        let bytes = self.image.as_raw();
        let rows = 0..self.small.height() as usize;
        for (y, columns, to) in parts(self.small, rows, self.needed) {
            let row = |y: usize| {
                let start = y * source;
                let part = bytes.get(start + 2 * columns.start..start + 2 * columns.end);
                part.unwrap_or_default().chunks_exact(2)
            };
            for ((to, a), b) in to.iter_mut().zip(row(2 * y)).zip(row(2 * y + 1)) {
                let sum: u16 = [a[0], a[1], b[0], b[1]].into_iter().map(u16::from).sum();
                *to = ((sum + 2) / 4) as u8;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgba, RgbaImage};

    fn halved(image: &GrayImage, needed: &Region) -> GrayImage {
        let mut small = GrayImage::default();
        half(image, needed, &mut small);
        small
    }

    #[test]
    fn half_a_picture_has_the_means_and_an_odd_edge_is_left_out() {
        let image = GrayImage::from_raw(3, 2, vec![0, 4, 9, 8, 12, 9]).unwrap();
        assert_eq!(halved(&image, &Region::whole((1, 1))).as_raw(), &[6]);
    }

    #[test]
    fn half_a_picture_has_the_mean_brightness_of_four_pixels() {
        let picture = RgbaImage::from_fn(22, 10, |x, y| {
            let value = |by: u32| {
                if (x + y) % 5 == 0 {
                    255
                } else {
                    (by * (x + 23 * y)) as u8
                }
            };
            Rgba([value(37), value(91), value(53), value(7)])
        });
        let mut half = GrayImage::default();
        half_luma(
            CropView::whole(&picture),
            0..10,
            &Region::whole((11, 5)),
            &mut half,
        );
        for (x, y, found) in half.enumerate_pixels() {
            let four = [(0, 0), (1, 0), (0, 1), (1, 1)];
            let four = four.map(|(dx, dy)| sum_of(&picture.get_pixel(2 * x + dx, 2 * y + dy).0));
            assert_eq!(u32::from(found.0[0]), four.iter().sum::<u32>() >> 10);
        }
    }

    #[test]
    fn what_is_needed_is_as_in_the_whole_and_no_more_is_made() {
        let picture = RgbaImage::from_fn(31, 24, |x, y| {
            Rgba([(9 * x) as u8, (x * y) as u8, (7 * y) as u8, 255])
        });
        let view = CropView::whole(&picture);
        let pixels = [(3, 2), (9, 4), (5, 6)];
        let some = |size| Region::around(pixels.into_iter(), 1, size);
        let [mut whole, mut part] = [GrayImage::default(), GrayImage::default()];
        let check = |part: &GrayImage, whole: &GrayImage, needed: &Region| {
            for (x, y, pixel) in part.enumerate_pixels() {
                let is_needed = needed.row(y as usize).contains(&(x as usize));
                let wanted = if is_needed {
                    whole.get_pixel(x, y).0
                } else {
                    [0]
                };
                assert_eq!(pixel.0, wanted, "{x} {y}");
            }
        };
        luma(view, 0..24, &Region::whole((31, 24)), &mut whole);
        luma(view, 0..7, &some((31, 24)), &mut part);
        luma(view, 7..24, &some((31, 24)), &mut part);
        check(&part, &whole, &some((31, 24)));
        let small = (15, 12);
        let quarter = halved(&whole, &Region::whole(small));
        check(&halved(&whole, &some(small)), &quarter, &some(small));
        half_luma(view, 0..24, &Region::whole(small), &mut whole);
        let mut part = GrayImage::default();
        half_luma(view, 0..7, &some(small), &mut part);
        half_luma(view, 7..24, &some(small), &mut part);
        check(&part, &whole, &some(small));
    }
}
