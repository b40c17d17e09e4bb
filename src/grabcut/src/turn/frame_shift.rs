//! Where the object is in one frame, compared with its average over a turn.
//!
//! A rig vibrates and drifts by a few pixels. A mask made from the average of many frames then lies beside
//! the object of the frame for which it is wanted. The shift is that at which the brightness's
//! gradients of both fit best under the mask.

use crate::bitmap::Bitmap;

/// Largest shift that is looked for in each direction, pixels.
const REACH: isize = 6;
/// The gradients have to fit better by this share than without a shift.
const BETTER_BY: f32 = 0.01;

/// The shift (right, down) in pixels of the object from `average` to `frame`, two images of brightness
/// of the same size; (0, 0) if none fits clearly better.
pub(crate) fn shift(
    average: &[f32],
    frame: &[f32],
    object: &Bitmap,
    size: (usize, usize),
) -> (f32, f32) {
    let average = gradients(average, size);
    let frame = gradients(frame, size);
    let pixels = inner_pixels(object, size);
    let fit = |step| fit(&average, &frame, &pixels, step);
    match best_shift(size.0, fit) {
        Some((shift, best)) if best >= fit(0) * (1.0 + BETTER_BY) => shift.into(),
        _ => (0.0, 0.0),
    }
}

/// The shift (right, down) at which it fits best, to a fraction of a pixel, and how well it fits there; `fit` gets
/// the step in row order. `None` if that is at the limit of what is looked for, or nothing fits.
fn best_shift(width: usize, fit: impl Fn(isize) -> f32) -> Option<([f32; 2], f32)> {
    let side = (2 * REACH + 1) as usize;
    let fit = |at: usize| {
        let (dx, dy) = ((at % side) as isize - REACH, (at / side) as isize - REACH);
        fit(dy * width as isize + dx)
    };
    let fits: Vec<f32> = (0..side * side).map(fit).collect();
    let (best, &most) = fits.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?;
    let (x, y) = (best % side, best / side);
    if most <= 0.0 || x == 0 || y == 0 || x + 1 == side || y + 1 == side {
        return None;
    }
    let dx = vertex(fits[best - 1], most, fits[best + 1]);
    let dy = vertex(fits[best - side], most, fits[best + side]);
    let shift = [x as f32 - REACH as f32 + dx, y as f32 - REACH as f32 + dy];
    Some((shift, most))
}

/// The labels moved by a shift (right, down): each pixel takes what was there before, between pixels the
/// larger share.
pub(crate) fn moved(
    object: &Bitmap,
    (dx, dy): (f32, f32),
    (width, height): (usize, usize),
) -> Bitmap {
    let value = |x: isize, y: isize| {
        let x = x.clamp(0, width as isize - 1) as usize;
        let y = y.clamp(0, height as isize - 1) as usize;
        f32::from(u8::from(object.bits()[y * width + x]))
    };
    object.map(|at, _| {
        let (x, y) = ((at % width) as f32 - dx, (at / width) as f32 - dy);
        let (left, top) = (x.floor(), y.floor());
        let (right_share, lower_share) = (x - left, y - top);
        let (left, top) = (left as isize, top as isize);
        let row = |y| (1.0 - right_share) * value(left, y) + right_share * value(left + 1, y);
        (1.0 - lower_share) * row(top) + lower_share * row(top + 1) >= 0.5
    })
}

/// The horizontal and vertical gradients; 0 at the border.
fn gradients(light: &[f32], (width, height): (usize, usize)) -> Vec<[f32; 2]> {
    let at = |at: usize| {
        let (x, y) = (at % width, at / width);
        if x == 0 || y == 0 || x + 1 == width || y + 1 == height {
            return [0.0, 0.0];
        }
        [
            light[at + 1] - light[at - 1],
            light[at + width] - light[at - width],
        ]
    };
    (0..light.len()).map(at).collect()
}

/// The object's pixels that stay inside the image under every shift.
fn inner_pixels(object: &Bitmap, (width, height): (usize, usize)) -> Vec<usize> {
    let reach = REACH as usize;
    let inside = |at: &usize| {
        let (x, y) = (at % width, at / width);
        x >= reach && y >= reach && x + reach < width && y + reach < height
    };
    let pixels = object.bits().iter().enumerate().filter(|(_, bit)| **bit);
    pixels.map(|(at, _)| at).filter(inside).collect()
}

/// How well the gradients fit if the object moved by `step` pixels in row order: the mean cosine,
/// weighted by the weaker gradient.
fn fit(average: &[[f32; 2]], frame: &[[f32; 2]], pixels: &[usize], step: isize) -> f32 {
    let (mut sum, mut weight) = (0.0, 0.0);
    for &at in pixels {
        let [ax, ay] = average[at];
        let [bx, by] = frame[at.saturating_add_signed(step)];
        sum += ax * bx + ay * by;
        weight += bx * bx + by * by;
    }
    sum / weight.sqrt().max(f32::MIN_POSITIVE)
}

/// The vertex of the parabola through three values at -1, 0 and 1.
fn vertex(before: f32, most: f32, after: f32) -> f32 {
    let curvature = before - 2.0 * most + after;
    if curvature >= 0.0 {
        return 0.0;
    }
    (0.5 * (before - after) / curvature).clamp(-0.5, 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (60, 50);

    /// A smooth pattern that has no period in the image, moved by (dx, dy).
    fn pattern(dx: f32, dy: f32) -> Vec<f32> {
        let value = |at: usize| {
            let (x, y) = ((at % SIZE.0) as f32 - dx, (at / SIZE.0) as f32 - dy);
            (x * 0.31).sin() + (y * 0.37).cos() + (x * 0.11 + y * 0.17).sin() * 2.0
        };
        (0..SIZE.0 * SIZE.1).map(value).collect()
    }

    fn middle() -> Bitmap {
        let inside = |at: usize| (15..45).contains(&(at % 60)) && (12..38).contains(&(at / 60));
        Bitmap::new((60, 50), (0..3000).map(inside))
    }

    #[test]
    fn a_shift_is_found_to_a_fraction_of_a_pixel() {
        for wanted in [(0.0, 0.0), (2.0, -1.0), (-1.5, 0.75)] {
            let (dx, dy) = shift(
                &pattern(0.0, 0.0),
                &pattern(wanted.0, wanted.1),
                &middle(),
                SIZE,
            );
            let off = (dx - wanted.0).hypot(dy - wanted.1);
            assert!(off < 0.2, "{wanted:?}: {dx} {dy}");
        }
    }

    #[test]
    fn an_image_without_structure_is_not_moved() {
        let flat = vec![3.0; 3000];
        assert_eq!(shift(&flat, &flat, &middle(), SIZE), (0.0, 0.0));
    }

    #[test]
    fn a_mask_is_moved_by_whole_and_by_half_pixels() {
        let at = |bitmap: &Bitmap, x: usize| bitmap.bits()[20 * 60 + x];
        let moved_by = |dx| moved(&middle(), (dx, 0.0), SIZE);
        assert!(!at(&moved_by(2.0), 16) && at(&moved_by(2.0), 17) && at(&moved_by(2.0), 46));
        assert!(at(&moved_by(-0.6), 14) && !at(&moved_by(-0.4), 14));
    }
}
