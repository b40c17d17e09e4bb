//! The colours of the pixels over the turn, in linear light: what adds up when light adds up.

use image::RgbImage;

/// The courses of all pixels: three numbers for each frame.
#[derive(Debug)]
pub(crate) struct PixelSeries {
    /// sRGB levels, pixel by pixel.
    levels: Vec<u8>,
    length: usize,
    size: (usize, usize),
    /// The linear light of each level.
    linear: [f32; 256],
}

impl PixelSeries {
    /// Of frames that all have this size.
    pub(crate) fn new(frames: &[RgbImage], size: (usize, usize)) -> Self {
        let length = 3 * frames.len();
        let mut levels = vec![0; length * size.0 * size.1];
        for (number, frame) in frames.iter().enumerate() {
            let series = levels.chunks_exact_mut(length.max(1));
            for (course, pixel) in series.zip(frame.as_raw().chunks_exact(3)) {
                course[3 * number..3 * number + 3].copy_from_slice(pixel);
            }
        }
        Self {
            levels,
            length,
            size,
            linear: std::array::from_fn(|level| linear_from_srgb(level as f32 / 255.0)),
        }
    }

    pub(crate) fn size(&self) -> (usize, usize) {
        self.size
    }

    /// How many numbers a course has.
    pub(crate) fn length(&self) -> usize {
        self.length
    }

    /// The mean course of some pixels.
    pub(crate) fn mean(&self, pixels: &[usize]) -> Vec<f32> {
        let mut mean = vec![0.0_f32; self.length];
        pixels.iter().for_each(|&at| self.add(at, &mut mean));
        scale(&mut mean, pixels.len());
        mean
    }

    /// The course of a pixel, averaged with those of its neighbours against noise.
    pub(crate) fn smooth(&self, at: usize) -> Vec<f32> {
        let (width, height) = self.size;
        let (columns, rows) = (near(at % width, width), near(at / width, height));
        let pixels = rows.flat_map(|row| columns.clone().map(move |column| row * width + column));
        self.mean(&pixels.collect::<Vec<_>>())
    }

    /// The results of `each` for the smooth courses of all pixels.
    pub(crate) fn map_smooth<T>(&self, mut each: impl FnMut(&[f32]) -> T) -> Vec<T> {
        let (width, height) = self.size;
        let mut results = Vec::with_capacity(width * height);
        // The mean of three rows, and of three pixels of it.
        let mut rows = vec![0.0_f32; self.length * width];
        let mut course = vec![0.0_f32; self.length];
        for y in 0..height {
            rows.fill(0.0);
            let above_and_below = near(y, height);
            let many = above_and_below.len();
            for row in above_and_below {
                for (x, sum) in rows.chunks_exact_mut(self.length.max(1)).enumerate() {
                    self.add(row * width + x, sum);
                }
            }
            scale(&mut rows, many);
            for x in 0..width {
                course.fill(0.0);
                let beside = near(x, width);
                let many = beside.len();
                for column in beside {
                    let one = &rows[column * self.length..(column + 1) * self.length];
                    course
                        .iter_mut()
                        .zip(one)
                        .for_each(|(sum, one)| *sum += one);
                }
                scale(&mut course, many);
                results.push(each(&course));
            }
        }
        results
    }

    fn add(&self, at: usize, sum: &mut [f32]) {
        let levels = &self.levels[at * self.length..(at + 1) * self.length];
        for (sum, &level) in sum.iter_mut().zip(levels) {
            *sum += self.linear[usize::from(level)];
        }
    }
}

/// A position of a side and its neighbours.
fn near(at: usize, side: usize) -> std::ops::Range<usize> {
    at.saturating_sub(1)..(at + 2).min(side)
}

fn scale(course: &mut [f32], many: usize) {
    let by = 1.0 / many.max(1) as f32;
    course.iter_mut().for_each(|value| *value *= by);
}

fn linear_from_srgb(value: f32) -> f32 {
    if value <= 0.040_45 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}

/// The scalar product, in several sums that a processor adds up side by side.
pub(crate) fn dot(a: &[f32], b: &[f32]) -> f32 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0_f32; 8];
    for (a, b) in a.iter().zip(b) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    let rest = a_rest.iter().zip(b_rest).map(|(a, b)| a * b);
    sums.iter().sum::<f32>() + rest.sum::<f32>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    #[test]
    fn the_courses_of_all_pixels_are_those_of_each() {
        let frame = |level: u8| RgbImage::from_fn(5, 4, |x, y| Rgb([level, 10 * x as u8, y as u8]));
        let series = PixelSeries::new(&[frame(0), frame(255)], (5, 4));
        let all = series.map_smooth(<[f32]>::to_vec);
        for (at, course) in all.iter().enumerate() {
            let one = series.smooth(at);
            let apart = course.iter().zip(&one).map(|(a, b)| (a - b).abs());
            assert!(apart.fold(0.0, f32::max) < 1e-5, "{at}");
        }
        assert!((series.mean(&[7])[3] - 1.0).abs() < 1e-6);
    }
}
