//! What a picture tells of exposure and focus. Pure functions over pixels.

use image::RgbImage;

use relit_data::geometry::Rect;

/// A channel counts as saturated from this value on.
const SATURATED: u8 = 250;

/// The middle of a picture: half its width and height, where the object stands.
#[must_use]
pub fn middle(width: u32, height: u32) -> Rect {
    let (w, h) = ((width / 2).max(1), (height / 2).max(1));
    let left = |whole: u32, part: u32| i32::try_from(whole.saturating_sub(part) / 2).unwrap_or(0);
    Rect::new(left(width, w), left(height, h), w, h)
}

/// The part of the pixels all of whose channels are at 250 or above, 0 to 1; 0 of no pixels.
#[must_use]
pub fn clipped(picture: &RgbImage) -> f64 {
    let pixels = picture.as_raw().as_chunks::<3>().0;
    let saturated = |rgb: &&[u8; 3]| rgb.iter().all(|&value| value >= SATURATED);
    match pixels.len() {
        0 => 0.0,
        all => pixels.iter().filter(saturated).count() as f64 / all as f64,
    }
}

/// The variance of the Laplacian of luma: greater is sharper. 0 of pictures too small for it.
#[must_use]
pub fn focus(picture: &RgbImage) -> f64 {
    let width = picture.width() as usize;
    let pixels = picture.as_raw().as_chunks::<3>().0;
    let luma: Vec<i32> = pixels.iter().map(luma).collect();
    if width < 3 || luma.len() < 3 * width {
        return 0.0;
    }
    let (mut sum, mut squares, mut count) = (0_i64, 0_i64, 0_u32);
    for rows in luma.chunks_exact(width).collect::<Vec<_>>().windows(3) {
        let [above, row, below] = rows else { continue };
        for x in 1..width - 1 {
            let laplacian = above[x] + below[x] + row[x - 1] + row[x + 1] - 4 * row[x];
            sum += i64::from(laplacian);
            squares += i64::from(laplacian) * i64::from(laplacian);
            count += 1;
        }
    }
    let count = f64::from(count);
    let mean = sum as f64 / count;
    squares as f64 / count - mean * mean
}

/// Luma of BT.601, 0 to 255.
fn luma(&[r, g, b]: &[u8; 3]) -> i32 {
    (299 * i32::from(r) + 587 * i32::from(g) + 114 * i32::from(b) + 500) / 1000
}

#[cfg(test)]
mod tests {
    use image::Rgb;

    use super::*;

    #[test]
    fn the_middle_is_half_as_wide_and_high_and_never_empty() {
        assert_eq!(middle(640, 480), Rect::new(160, 120, 320, 240));
        assert_eq!(middle(1, 1), Rect::new(0, 0, 1, 1));
    }

    #[test]
    fn only_pixels_saturated_in_all_channels_count_as_clipped() {
        let mut picture = RgbImage::from_pixel(2, 2, Rgb([255, 255, 249]));
        assert_eq!(clipped(&picture), 0.0);
        picture.put_pixel(0, 0, Rgb([250, 250, 250]));
        assert_eq!(clipped(&picture), 0.25);
        assert_eq!(clipped(&RgbImage::new(0, 0)), 0.0);
    }

    #[test]
    fn a_sharp_edge_has_a_greater_figure_than_a_soft_one_and_a_flat_picture_none() {
        let stripes = |period: u32| {
            RgbImage::from_fn(16, 16, |x, _| {
                let distance = (x % (2 * period)).abs_diff(period) * 255 / period;
                Rgb([distance as u8; 3])
            })
        };
        assert!(focus(&stripes(1)) > 4.0 * focus(&stripes(4)));
        assert_eq!(focus(&RgbImage::from_pixel(8, 8, Rgb([90; 3]))), 0.0);
        assert_eq!(focus(&RgbImage::new(2, 2)), 0.0);
    }
}
