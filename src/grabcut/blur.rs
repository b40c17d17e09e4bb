//! Gaussian blur of 8-bit images in fixed point, so that the bytes are the same on every machine.
//!
//! Weights have 8 fractional bits, and the rounding error of each is carried to the next towards the middle,
//! so that they sum to 1 exactly. The result equals that of OpenCV's `GaussianBlur`.

/// 1 in fixed point.
const ONE: i64 = 256;
/// Standard deviations that the weights reach to each side.
const REACH: f64 = 3.0;

/// The image (`levels`, row by row) blurred with a standard deviation of `sigma` pixels. Beyond the border the
/// outermost pixels go on: the frame's border is no edge.
pub(super) fn blur(levels: &[u8], (width, height): (u32, u32), sigma: f64) -> Vec<u8> {
    let (width, height) = (width as usize, height as usize);
    let weights = |side: usize| if side == 1 { vec![ONE] } else { weights(sigma) };
    let (across, down) = (weights(width), weights(height));
    let mut rows: Vec<u32> = Vec::with_capacity(levels.len());
    for row in levels.chunks_exact(width.max(1)) {
        rows.extend((0..width).map(|x| {
            let sum = weighted(&across, x, width, |x| i64::from(row[x]));
            // 16 bits are kept between the two passes.
            sum.clamp(0, i64::from(u16::MAX)) as u32
        }));
    }
    let at = |at: usize| {
        let (x, y) = (at % width, at / width);
        let sum = weighted(&down, y, height, |y| i64::from(rows[y * width + x]));
        ((sum + ONE * ONE / 2) / (ONE * ONE)).clamp(0, 255) as u8
    };
    (0..rows.len()).map(at).collect()
}

/// The weighted sum of the values around `middle`.
fn weighted(weights: &[i64], middle: usize, count: usize, value: impl Fn(usize) -> i64) -> i64 {
    let reach = weights.len() / 2;
    let place = |tap: usize| (middle + tap).saturating_sub(reach).min(count - 1);
    let taps = weights.iter().enumerate();
    taps.map(|(tap, weight)| weight * value(place(tap))).sum()
}

/// An odd number of weights, symmetric, with the sum [`ONE`].
fn weights(sigma: f64) -> Vec<i64> {
    let reach = ((sigma * REACH * 2.0 + 1.0).round_ties_even() as usize | 1) / 2;
    let exact: Vec<f64> = (0..reach)
        .map(|tap| {
            let way = (reach - tap) as f64;
            (-0.5 * way * way / (sigma * sigma)).exp()
        })
        .collect();
    let sum = 1.0 + 2.0 * exact.iter().sum::<f64>();
    let mut carried = 0.0;
    let side: Vec<i64> = exact
        .iter()
        .map(|weight| {
            let wanted = weight / sum * ONE as f64 + carried;
            let rounded = wanted.round_ties_even();
            carried = wanted - rounded;
            rounded as i64
        })
        .collect();
    let middle = ONE - 2 * side.iter().sum::<i64>();
    let other = side.iter().rev();
    side.iter().chain([&middle]).chain(other).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_symmetric_and_sum_to_one() {
        for sigma in [0.4, 0.78, 1.2, 7.8, 39.0] {
            let weights = weights(sigma);
            assert_eq!(weights.iter().sum::<i64>(), ONE, "{sigma}");
            let reversed: Vec<i64> = weights.iter().rev().copied().collect();
            assert_eq!(weights, reversed, "{sigma}");
        }
    }

    #[test]
    fn a_flat_image_stays_flat_up_to_its_border() {
        assert_eq!(blur(&[200; 35], (7, 5), 2.5), [200; 35]);
        assert!(blur(&[], (0, 0), 2.5).is_empty());
    }
}
