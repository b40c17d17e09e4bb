//! The layers of a convolutional network, on the processor: planes of numbers, convolutions of 3 x 3, alone or
//! in residual blocks, and changes of size by two.

#[cfg(not(target_family = "wasm"))]
use pulp::Arch;

/// So many output channels and columns are computed together.
const CHANNELS: usize = 4;
const COLUMNS: usize = 16;
/// A convolution sees so many columns and rows.
const KERNEL: usize = 3;

/// Planes of numbers of one size, one after another.
#[derive(Debug, Clone)]
pub(crate) struct Planes {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) values: Vec<f32>,
}

impl Planes {
    /// Planes full of zeros.
    pub(crate) fn zeros(channels: usize, (width, height): (usize, usize)) -> Self {
        Self {
            width,
            height,
            values: vec![0.0; channels * width * height],
        }
    }

    pub(crate) fn channels(&self) -> usize {
        self.values.len() / self.area().max(1)
    }

    pub(crate) fn area(&self) -> usize {
        self.width * self.height
    }

    /// These planes, then `others` of the same size.
    pub(super) fn followed_by(mut self, others: &Self) -> Self {
        self.values.extend(&others.values);
        self
    }

    /// At half the size, an even one: the mean of each two by two.
    pub(super) fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let rows = self.values.chunks_exact(2 * self.width.max(1));
        let values = rows.flat_map(|rows| {
            let (upper, lower) = rows.split_at(self.width);
            let pairs = upper.chunks_exact(2).zip(lower.chunks_exact(2));
            pairs.map(|(a, b)| (a[0] + a[1] + b[0] + b[1]) / 4.0)
        });
        Self {
            values: values.collect(),
            width,
            height,
        }
    }

    /// At twice the size, each number four times.
    pub(super) fn doubled(&self) -> Self {
        let mut values = Vec::with_capacity(4 * self.values.len());
        for row in self.values.chunks_exact(self.width.max(1)) {
            let twice = || row.iter().flat_map(|&value| [value; 2]);
            values.extend(twice());
            values.extend(twice());
        }
        Self {
            values,
            width: 2 * self.width,
            height: 2 * self.height,
        }
    }

    /// With a margin of zeros, wide enough on the right for whole groups of columns.
    fn padded(&self) -> Self {
        let width = self.width.next_multiple_of(COLUMNS) + KERNEL - 1;
        let mut padded = Self::zeros(self.channels(), (width, self.height + KERNEL - 1));
        let area = padded.area();
        for (channel, plane) in self.values.chunks_exact(self.area().max(1)).enumerate() {
            for (y, row) in plane.chunks_exact(self.width).enumerate() {
                let begin = channel * area + (y + 1) * width + 1;
                padded.values[begin..begin + self.width].copy_from_slice(row);
            }
        }
        padded
    }
}

/// A convolution of 3 x 3 with zeros around the planes.
#[derive(Debug)]
pub(super) struct Convolution {
    /// By groups of output channels: for each input channel, row and column, one weight a channel.
    weights: Vec<[f32; CHANNELS]>,
    biases: Vec<f32>,
    inputs: usize,
    /// Whether negative results become zero.
    is_rectified: bool,
}

impl Convolution {
    /// `weights` in the order output channel, input channel, row, column; one of `biases` an output channel.
    pub(super) fn new(weights: &[f32], biases: Vec<f32>, is_rectified: bool) -> Self {
        let outputs = biases.len();
        let each = weights.len() / outputs.max(1);
        let groups = (0..outputs).step_by(CHANNELS);
        let grouped = groups.flat_map(|first| {
            (0..each).map(move |at| {
                std::array::from_fn(|channel| {
                    let weight = weights.get((first + channel) * each + at);
                    weight.copied().unwrap_or(0.0)
                })
            })
        });
        Self {
            weights: grouped.collect(),
            biases,
            inputs: each / (KERNEL * KERNEL),
            is_rectified,
        }
    }

    /// The result for planes of as many channels as the layer has inputs.
    pub(super) fn apply(&self, planes: &Planes) -> Planes {
        let mut result = Planes::zeros(self.biases.len(), (planes.width, planes.height));
        let padded = planes.padded();
        // `Arch` would add a version for relaxed SIMD, which not every browser has.
        #[cfg(target_family = "wasm")]
        self.fill(&padded, &mut result);
        #[cfg(not(target_family = "wasm"))]
        Arch::new().dispatch(|| self.fill(&padded, &mut result));
        result
    }

    #[inline(always)]
    fn fill(&self, padded: &Planes, result: &mut Planes) {
        let each = self.inputs * KERNEL * KERNEL;
        let (width, area) = (result.width, result.area());
        for y in 0..result.height {
            for (group, weights) in self.weights.chunks_exact(each.max(1)).enumerate() {
                let first = group * CHANNELS;
                for x in (0..width).step_by(COLUMNS) {
                    let sums = sums(weights, padded, x, y);
                    let many = COLUMNS.min(width - x);
                    let biases = self.biases[first..].iter();
                    for (channel, (sums, bias)) in sums.iter().zip(biases).enumerate() {
                        let begin = (first + channel) * area + y * width + x;
                        let values = &mut result.values[begin..begin + many];
                        for (value, sum) in values.iter_mut().zip(sums) {
                            let sum = sum + bias;
                            *value = if self.is_rectified { sum.max(0.0) } else { sum };
                        }
                    }
                }
            }
        }
    }
}

/// A step from planes to others of the same size. A plain one may change their number.
#[derive(Debug)]
pub(super) enum Layer {
    Plain(Convolution),
    /// What the convolutions make of the planes is added to them.
    Residual([Convolution; 2]),
}

impl Layer {
    pub(super) fn apply(&self, planes: Planes) -> Planes {
        match self {
            Self::Plain(convolution) => convolution.apply(&planes),
            Self::Residual([first, second]) => {
                let mut sum = second.apply(&first.apply(&planes));
                for (sum, value) in sum.values.iter_mut().zip(&planes.values) {
                    *sum += value;
                }
                sum
            }
        }
    }
}

/// The weighted sums of a group of channels for a group of columns from `x` on.
#[inline(always)]
fn sums(
    weights: &[[f32; CHANNELS]],
    padded: &Planes,
    x: usize,
    y: usize,
) -> [[f32; COLUMNS]; CHANNELS] {
    let mut sums = [[0.0_f32; COLUMNS]; CHANNELS];
    let planes = padded.values.chunks_exact(padded.area());
    let kernels = weights.as_chunks::<{ KERNEL * KERNEL }>().0;
    for (plane, kernel) in planes.zip(kernels) {
        for (row, kernel) in kernel.as_chunks::<KERNEL>().0.iter().enumerate() {
            let begin = (y + row) * padded.width + x;
            let Some(values) = plane[begin..].first_chunk::<{ COLUMNS + KERNEL - 1 }>() else {
                continue;
            };
            for (column, weights) in kernel.iter().enumerate() {
                for (sums, weight) in sums.iter_mut().zip(weights) {
                    for (at, sum) in sums.iter_mut().enumerate() {
                        *sum += weight * values[at + column];
                    }
                }
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers that look random.
    fn numbers(count: usize) -> Vec<f32> {
        (0..count)
            .map(|at| ((at * 37 + 11) % 23) as f32 / 11.0 - 1.0)
            .collect()
    }

    #[test]
    fn a_convolution_is_the_sum_over_neighbours_and_channels() {
        let (width, height, inputs, outputs) = (21, 5, 3, 6);
        let planes = Planes {
            values: numbers(inputs * width * height),
            width,
            height,
        };
        let weights = numbers(outputs * inputs * 9);
        let biases = numbers(outputs);
        let result = Convolution::new(&weights, biases.clone(), false).apply(&planes);
        assert_eq!((result.channels(), result.width), (outputs, width));
        let value = |channel: usize, x: isize, y: isize| {
            let inside = (0..width as isize).contains(&x) && (0..height as isize).contains(&y);
            let at = channel as isize * (width * height) as isize + y * width as isize + x;
            if inside {
                planes.values[at as usize]
            } else {
                0.0
            }
        };
        for output in 0..outputs {
            for (x, y) in [(0, 0), (7, 2), (15, 4), (16, 1), (20, 4)] {
                let mut sum = biases[output];
                for (at, weight) in weights[output * inputs * 9..][..inputs * 9]
                    .iter()
                    .enumerate()
                {
                    let (dx, dy) = (at as isize % 3 - 1, at as isize / 3 % 3 - 1);
                    sum += weight * value(at / 9, x + dx, y + dy);
                }
                let found =
                    result.values[output * width * height + (y * width as isize + x) as usize];
                assert!(
                    (found - sum).abs() < 1e-5,
                    "{output} {x} {y}: {found} {sum}"
                );
            }
        }
    }

    #[test]
    fn a_residual_layer_adds_to_its_planes() {
        let planes = Planes {
            values: numbers(3 * 20 * 4),
            width: 20,
            height: 4,
        };
        let convolution = |bias: f32, is_rectified| {
            Convolution::new(&[0.0; 3 * 3 * 9], vec![bias; 3], is_rectified)
        };
        let layer = Layer::Residual([convolution(1.0, true), convolution(-0.5, false)]);
        let result = layer.apply(planes.clone());
        let mut pairs = result.values.iter().zip(&planes.values);
        assert!(pairs.all(|(found, value)| (found - (value - 0.5)).abs() < 1e-6));
    }

    #[test]
    fn halved_planes_have_the_mean_and_doubled_ones_repeat_it() {
        let planes = Planes {
            values: numbers(2 * 4 * 2),
            width: 4,
            height: 2,
        };
        let half = planes.halved();
        assert_eq!((half.width, half.height, half.channels()), (2, 1, 2));
        let of_right: f32 = [2, 3, 6, 7].iter().map(|&at| planes.values[at]).sum();
        assert!((half.values[1] - of_right / 4.0).abs() < 1e-6);
        let again = half.doubled();
        assert_eq!(again.values[4], half.values[0]);
        assert_eq!(again.values[8], half.values[2]);
    }
}
