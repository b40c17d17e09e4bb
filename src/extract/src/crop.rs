//! The crop of a video, the same for all frames: the mask's bounding box with a margin, made square.

use image::{GrayImage, RgbaImage};

use relit_data::geometry::Rect;

/// The square around `object` whose side is the object's longer side plus `margin` (a fraction of
/// that side) on both sides. It is centred on the object and moved into the frame if it fits;
/// otherwise it extends beyond the frame, where the image is 0.
pub fn square_around(object: Rect, margin: f64, frame: (u32, u32)) -> Rect {
    let longer = object.w.max(object.h);
    let side = longer + 2 * (f64::from(longer) * margin).round() as u32;
    let x = start_of(object.x, object.w, side, frame.0);
    let y = start_of(object.y, object.h, side, frame.1);
    Rect::new(x, y, side, side)
}

/// The start of `side` pixels that are centred on `start..start + extent`, and inside `0..whole` if
/// they fit.
fn start_of(start: i32, extent: u32, side: u32, whole: u32) -> i32 {
    let centred = i64::from(start) - (i64::from(side) - i64::from(extent)).div_euclid(2);
    let free = i64::from(whole) - i64::from(side);
    let moved = if free >= 0 {
        centred.clamp(0, free)
    } else {
        centred.clamp(free, 0)
    };
    moved as i32
}

/// The part of the mask under `crop`; 0 where the crop extends beyond it.
pub fn cut(mask: &GrayImage, crop: Rect) -> GrayImage {
    GrayImage::from_fn(crop.w, crop.h, |x, y| {
        let x = i64::from(crop.x) + i64::from(x);
        let y = i64::from(crop.y) + i64::from(y);
        let inside = u32::try_from(x).ok().zip(u32::try_from(y).ok());
        inside
            .and_then(|(x, y)| mask.get_pixel_checked(x, y))
            .copied()
            .unwrap_or(image::Luma([0]))
    })
}

/// Repeats the frame's outermost pixels where the picture of `region` lies beyond the frame.
pub(super) fn repeat_edge(picture: &mut RgbaImage, region: Rect, frame: (u32, u32)) {
    let inside = region.clipped_to(frame.0, frame.1);
    let Some(inside) = inside.filter(|&inside| inside != region) else {
        return;
    };
    let (left, top) = (region.x.abs_diff(inside.x), region.y.abs_diff(inside.y));
    let (left, top) = (left as usize, top as usize);
    let (right, bottom) = (left + inside.w as usize, top + inside.h as usize);
    let width = 4 * region.w as usize;
    let bytes = picture.as_flat_samples_mut().samples;
    for row in bytes.chunks_exact_mut(width.max(4)).take(bottom).skip(top) {
        let (beyond, seen) = row.split_at_mut(4 * left);
        let (seen, behind) = seen.split_at_mut(4 * (right - left));
        for (pixels, edge) in [
            (beyond, seen.first_chunk()),
            (behind, seen.last_chunk::<4>()),
        ] {
            for pixel in pixels.chunks_exact_mut(4) {
                pixel.copy_from_slice(edge.unwrap_or(&[0; 4]));
            }
        }
    }
    for y in 0..top {
        bytes.copy_within(top * width..(top + 1) * width, y * width);
    }
    for y in bottom..region.h as usize {
        bytes.copy_within((bottom - 1) * width..bottom * width, y * width);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_crop_is_square_and_centred_with_its_margin() {
        let crop = square_around(Rect::new(200, 100, 100, 60), 0.05, (640, 480));
        assert_eq!(crop, Rect::new(195, 75, 110, 110));
    }

    #[test]
    fn a_crop_at_the_edge_is_moved_inside() {
        let crop = square_around(Rect::new(0, 440, 100, 40), 0.05, (640, 480));
        assert_eq!(crop, Rect::new(0, 370, 110, 110));
    }

    #[test]
    fn an_object_wider_than_the_frame_is_high_is_padded() {
        let crop = square_around(Rect::new(20, 100, 600, 200), 0.05, (640, 480));
        assert_eq!((crop.w, crop.h), (660, 660));
        assert!(crop.y <= 0 && crop.bottom() >= 480);
        let mask = GrayImage::from_pixel(640, 480, image::Luma([255]));
        let cut = cut(&mask, crop);
        assert_eq!(cut.get_pixel(330, 0).0, [0]);
        assert_eq!(cut.get_pixel(330, 330).0, [255]);
    }

    #[test]
    fn beyond_the_frame_its_edge_is_repeated() {
        use image::Rgba;
        let level = |x: i32, y: i32| Rgba([(10 * x) as u8, (10 * y) as u8, 7, 255]);
        let region = Rect::new(-2, 3, 9, 8);
        let frame = (6, 8);
        let mut picture = RgbaImage::new(9, 8);
        let place = |x: u32, y: u32| (x as i32 + region.x, y as i32 + region.y);
        for (x, y, pixel) in picture.enumerate_pixels_mut() {
            let (x, y) = place(x, y);
            if (0..6).contains(&x) && y < 8 {
                *pixel = level(x, y);
            }
        }
        repeat_edge(&mut picture, region, frame);
        for (x, y, pixel) in picture.enumerate_pixels() {
            let (x, y) = place(x, y);
            assert_eq!(*pixel, level(x.clamp(0, 5), y.min(7)), "{x} {y}");
        }
    }

    proptest! {
        #[test]
        fn the_crop_always_holds_the_object(
            x in 0_i32..600, y in 0_i32..400, w in 1_u32..600, h in 1_u32..400, margin in 0.0..0.5,
        ) {
            let object = Rect::new(x, y, w.min(640 - x as u32), h.min(480 - y as u32));
            let crop = square_around(object, margin, (640, 480));
            prop_assert_eq!(crop.w, crop.h);
            prop_assert!(crop.x <= object.x && crop.y <= object.y);
            prop_assert!(crop.right() >= object.right() && crop.bottom() >= object.bottom());
        }
    }
}
