//! The colours of the pixels over the turn, in linear light: what adds up when light adds up.

use image::RgbImage;
use relit_data::srgb::to_linear_f32;

/// The courses of all pixels: three numbers for each frame.
#[derive(Debug, Clone)]
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
            linear: std::array::from_fn(|level| to_linear_f32(level as f32 / 255.0)),
        }
    }

    pub(crate) fn size(&self) -> (usize, usize) {
        self.size
    }

    /// The mean course of some pixels.
    pub(crate) fn mean(&self, pixels: &[usize]) -> Vec<f32> {
        let mut mean = vec![0.0_f32; self.length];
        pixels.iter().for_each(|&at| self.add(at, &mut mean));
        scale(&mut mean, pixels.len());
        mean
    }

    fn add(&self, at: usize, sum: &mut [f32]) {
        let levels = &self.levels[at * self.length..(at + 1) * self.length];
        for (sum, &level) in sum.iter_mut().zip(levels) {
            *sum += self.linear[usize::from(level)];
        }
    }
}

fn scale(course: &mut [f32], many: usize) {
    let by = 1.0 / many.max(1) as f32;
    course.iter_mut().for_each(|value| *value *= by);
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
    fn a_course_is_the_mean_of_linear_light() {
        let frame = |level: u8| RgbImage::from_fn(5, 4, |x, y| Rgb([level, 10 * x as u8, y as u8]));
        let series = PixelSeries::new(&[frame(0), frame(255)], (5, 4));
        let mean = series.mean(&[7, 8]);
        assert_eq!((mean.len(), mean[0]), (6, 0.0));
        assert!((mean[3] - 1.0).abs() < 1e-6);
        let green = [20.0_f32, 30.0].map(|level| to_linear_f32(level / 255.0));
        assert!((mean[1] - (green[0] + green[1]) / 2.0).abs() < 1e-6);
    }
}
