//! Means over squares of pixels.

use relight_core::image::{Extent, Planes};

/// The mean over a square of `radius` pixels to each side, as far as it lies inside the image.
pub(crate) fn blurred<const C: usize>(image: &Planes<C>, radius: usize) -> Planes<C> {
    let extent = image.extent();
    if radius == 0 || extent.pixels() == 0 {
        return image.clone();
    }
    let mut result = image.clone();
    result.fill_rows(|_, row| {
        for line in row {
            means_of_line(line, radius);
        }
    });
    for plane in result.planes_mut() {
        means_of_columns(plane, extent, radius);
    }
    result
}

/// The mean of the values with these weights over a square, and the weight that it has there: where that is 0, the
/// values are 0.
pub(crate) fn weighted_mean<const C: usize>(
    image: &Planes<C>,
    weights: &Planes<1>,
    radius: usize,
) -> (Planes<C>, Planes<1>) {
    // What has no weight may be no number.
    let weighted = |value, weight| if weight > 0.0 { value * weight } else { 0.0 };
    let sums = blurred(&image.clone().zip(weights, weighted), radius);
    let all = blurred(weights, radius);
    let mean = |sum, weight| {
        if weight > MIN_WEIGHT {
            sum / weight
        } else {
            0.0
        }
    };
    (sums.zip(&all, mean), all)
}

/// Weights below this are rounding.
const MIN_WEIGHT: f32 = 1e-9;

fn means_of_line(line: &mut [f32], radius: usize) {
    let mut sums = Vec::with_capacity(line.len() + 1);
    sums.push(0.0_f64);
    let mut sum = 0.0;
    for &value in &*line {
        sum += f64::from(value);
        sums.push(sum);
    }
    let length = line.len();
    for (at, value) in line.iter_mut().enumerate() {
        let (from, to) = (at.saturating_sub(radius), (at + radius + 1).min(length));
        *value = ((sums[to] - sums[from]) / (to - from) as f64) as f32;
    }
}

fn means_of_columns(plane: &mut [f32], extent: Extent, radius: usize) {
    let Extent { width, height } = extent;
    let source = plane.to_vec();
    let mut sums = vec![0.0_f64; width];
    let add = |row: usize, sign: f64, sums: &mut Vec<f64>| {
        let line = &source[row * width..][..width];
        for (sum, &value) in sums.iter_mut().zip(line) {
            *sum += sign * f64::from(value);
        }
    };
    for row in 0..radius.min(height) {
        add(row, 1.0, &mut sums);
    }
    for row in 0..height {
        if row + radius < height {
            add(row + radius, 1.0, &mut sums);
        }
        if row > radius {
            add(row - radius - 1, -1.0, &mut sums);
        }
        let count = (row + radius + 1).min(height) - row.saturating_sub(radius);
        let line = &mut plane[row * width..][..width];
        for (value, sum) in line.iter_mut().zip(&sums) {
            *value = (sum / count as f64) as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_is_that_of_the_pixels_inside_the_square_and_the_image() {
        let image = Planes::from_fn(Extent::new(7, 5), |x, y| [(x * x + 3 * y) as f32]);
        for radius in [1, 2, 9] {
            let found = blurred(&image, radius);
            for y in 0..5_usize {
                for x in 0..7_usize {
                    let rows = y.saturating_sub(radius)..(y + radius + 1).min(5);
                    let values: Vec<f32> = rows
                        .flat_map(|row| {
                            let columns = x.saturating_sub(radius)..(x + radius + 1).min(7);
                            columns.map(move |column| (row, column))
                        })
                        .map(|(row, column)| image.pixel(column, row)[0])
                        .collect();
                    let mean = values.iter().sum::<f32>() / values.len() as f32;
                    assert!((found.pixel(x, y)[0] - mean).abs() < 1e-4);
                }
            }
        }
    }

    #[test]
    fn what_has_no_weight_does_not_count() {
        let extent = Extent::new(6, 1);
        let image = Planes::from_fn(extent, |x, _| [if x < 3 { 2.0 } else { f32::NAN }]);
        let weights = Planes::from_fn(extent, |x, _| [f32::from(u8::from(x < 3))]);
        let (mean, weight) = weighted_mean(&image, &weights, 1);
        assert_eq!(mean.pixel(3, 0), [2.0]);
        assert_eq!(mean.pixel(5, 0), [0.0]);
        assert_eq!(weight.pixel(5, 0), [0.0]);
    }
}
