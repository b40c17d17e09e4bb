//! The weights with which a scaled pixel is made of source pixels, in one direction.

use std::f64::consts::PI;

/// A filter, by its weight at a distance in pixels of the coarser of both grids.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Filter {
    /// For scaling down: a sinc under a Hamming window of one pixel.
    Hamming,
    /// For scaling up: linear interpolation.
    Bilinear,
    /// For pictures that keep their size: cubic convolution, a = -1/2.
    CatmullRom,
}

impl Filter {
    fn radius(self) -> f64 {
        match self {
            Self::Hamming | Self::Bilinear => 1.0,
            Self::CatmullRom => 2.0,
        }
    }

    fn weight(self, distance: f64) -> f64 {
        let x = distance.abs();
        match self {
            _ if x >= self.radius() => 0.0,
            Self::Hamming if x == 0.0 => 1.0,
            Self::Hamming => (PI * x).sin() / (PI * x) * (0.54 + 0.46 * (PI * x).cos()),
            Self::Bilinear => 1.0 - x,
            Self::CatmullRom if x < 1.0 => (1.5 * x - 2.5) * x * x + 1.0,
            Self::CatmullRom => ((-0.5 * x + 2.5) * x - 4.0) * x + 2.0,
        }
    }
}

/// For each pixel of the output, the source pixels that it is made of.
#[derive(Debug, Default)]
pub(super) struct Axis {
    /// Weights of each output pixel, a multiple of four: 0 where there are fewer.
    taps: usize,
    starts: Vec<usize>,
    ends: Vec<usize>,
    weights: Vec<f32>,
}

impl Axis {
    /// `outputs` pixels of the part of `source` pixels that begins at `from` and is `length` long.
    pub(super) fn new(
        source: usize,
        (from, length): (f64, f64),
        outputs: usize,
        filter: Filter,
    ) -> Self {
        let step = length / outputs.max(1) as f64;
        let coarser = step.max(1.0);
        let radius = filter.radius() * coarser;
        let taps = (2.0 * radius).ceil() as usize + 1;
        let taps = taps.next_multiple_of(4);
        let mut axis = Self {
            taps,
            ..Self::default()
        };
        for output in 0..outputs {
            let centre = from + (output as f64 + 0.5) * step;
            let start = ((centre - radius + 0.5).floor().max(0.0) as usize).min(source);
            let end = ((centre + radius + 0.5).floor().max(0.0) as usize).clamp(start, source);
            let weights: Vec<f64> = (start..end)
                .map(|at| filter.weight((at as f64 + 0.5 - centre) / coarser))
                .collect();
            let sum: f64 = weights.iter().sum();
            axis.starts.push(start);
            axis.ends.push(end);
            let weights = weights.iter().map(|weight| (weight / sum) as f32);
            let padding = std::iter::repeat_n(0.0, taps + start - end);
            axis.weights.extend(weights.chain(padding));
        }
        axis
    }

    pub(super) fn outputs(&self) -> usize {
        self.starts.len()
    }

    /// Weights of an output pixel, with padding.
    pub(super) fn taps(&self) -> usize {
        self.taps
    }

    /// The first source pixel of an output pixel and all its weights.
    pub(super) fn window(&self, output: usize) -> (usize, &[f32]) {
        let weights = self
            .weights
            .get(output * self.taps..(output + 1) * self.taps);
        (
            self.starts.get(output).copied().unwrap_or_default(),
            weights.unwrap_or_default(),
        )
    }

    /// One past the last source pixel of an output pixel.
    pub(super) fn end(&self, output: usize) -> usize {
        self.ends.get(output).copied().unwrap_or_default()
    }

    /// The largest number of outputs to which one source pixel belongs.
    pub(super) fn overlap(&self) -> usize {
        let reaching = |output: usize| {
            let start = self.window(output).0;
            let earlier = self.ends.iter().take(output + 1).rev();
            earlier.take_while(|&&end| end > start).count()
        };
        (0..self.outputs()).map(reaching).max().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weights_of_each_pixel_sum_to_one_and_lie_around_it() {
        for (source, outputs, filter) in [
            (950, 256, Filter::Hamming),
            (31, 30, Filter::Hamming),
            (20, 90, Filter::Bilinear),
            (60, 60, Filter::CatmullRom),
        ] {
            let axis = Axis::new(source, (0.0, source as f64), outputs, filter);
            for output in 0..outputs {
                let (start, weights) = axis.window(output);
                assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
                let mean: f32 = (start..)
                    .zip(weights)
                    .map(|(at, w)| (at as f32 + 0.5) * w)
                    .sum();
                let centre = (output as f32 + 0.5) * source as f32 / outputs as f32;
                let at_edge = start == 0 || axis.end(output) == source;
                assert!(
                    at_edge || (mean - centre).abs() < 0.2,
                    "{output}: {mean} {centre}"
                );
            }
            assert!(axis.overlap() >= 1);
        }
    }

    #[test]
    fn at_the_same_size_and_place_each_pixel_is_itself() {
        let axis = Axis::new(10, (0.0, 10.0), 10, Filter::CatmullRom);
        for output in 0..10 {
            let (start, weights) = axis.window(output);
            for (at, weight) in (start..).zip(weights) {
                assert!((weight - f32::from(u8::from(at == output))).abs() < 1e-6);
            }
        }
    }
}
