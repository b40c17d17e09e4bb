//! The layers of a convolutional network, on the processor: planes of numbers, convolutions, alone or in blocks, and
//! changes of size by two.

#[cfg(not(target_family = "wasm"))]
use pulp::{Arch, NullaryFnOnce};

/// So many output channels and columns are computed together.
const CHANNELS: usize = 4;
const COLUMNS: usize = 16;

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

    fn plus(mut self, others: &Self) -> Self {
        for (value, other) in self.values.iter_mut().zip(&others.values) {
            *value += other;
        }
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

    /// Every second column, from the second on.
    fn every_second_column(&self) -> Self {
        let values = self.values.chunks_exact(2).map(|pair| pair[1]);
        Self {
            values: values.collect(),
            width: self.width / 2,
            height: self.height,
        }
    }

    /// With a margin of zeros, wide enough on the right for whole groups of columns.
    fn padded(&self, margin: usize) -> Self {
        let width = self.width.next_multiple_of(COLUMNS) + 2 * margin;
        let mut padded = Self::zeros(self.channels(), (width, self.height + 2 * margin));
        let area = padded.area();
        for (channel, plane) in self.values.chunks_exact(self.area().max(1)).enumerate() {
            for (y, row) in plane.chunks_exact(self.width).enumerate() {
                let begin = channel * area + (y + margin) * width + margin;
                padded.values[begin..begin + self.width].copy_from_slice(row);
            }
        }
        padded
    }
}

/// What happens to the results of a layer.
#[derive(Debug, Clone, Copy)]
pub(super) enum Activation {
    None,
    /// Negative ones become zero.
    Relu,
    /// And those above six become six.
    Relu6,
}

impl Activation {
    #[inline(always)]
    fn apply(self, value: f32) -> f32 {
        match self {
            Self::None => value,
            Self::Relu => value.max(0.0),
            Self::Relu6 => value.clamp(0.0, 6.0),
        }
    }
}

/// A layer that computes rows from planes with a margin.
trait Filling {
    /// Fills a result with every `step`th row.
    fn fill(&self, padded: &Planes, step: usize, result: &mut Planes);
}

/// Fills a result with every `step`th row, by the instructions that the processor has.
fn filled(layer: &impl Filling, padded: &Planes, step: usize, result: &mut Planes) {
    // `Arch` would add a version for relaxed SIMD, which not every browser has.
    #[cfg(target_family = "wasm")]
    layer.fill(padded, step, result);
    #[cfg(not(target_family = "wasm"))]
    Arch::new().dispatch(Task {
        layer,
        padded,
        step,
        result,
    });
}

/// Not a closure, because these are not always inlined, and only what is gets the processor's instructions.
#[cfg(not(target_family = "wasm"))]
struct Task<'a, L> {
    layer: &'a L,
    padded: &'a Planes,
    step: usize,
    result: &'a mut Planes,
}

#[cfg(not(target_family = "wasm"))]
impl<L: Filling> NullaryFnOnce for Task<'_, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.layer.fill(self.padded, self.step, self.result);
    }
}

/// A convolution with zeros around the planes.
#[derive(Debug)]
pub(super) struct Convolution {
    /// By groups of output channels: for each input channel, row and column, one weight a channel.
    weights: Vec<[f32; CHANNELS]>,
    biases: Vec<f32>,
    inputs: usize,
    /// It sees so many columns and rows, 1 or 3.
    side: usize,
    activation: Activation,
}

impl Convolution {
    /// `weights` in the order output channel, input channel, row, column; `side` rows and columns, 1 or 3; one of `biases`
    /// an output channel.
    pub(super) fn new(
        weights: &[f32],
        biases: Vec<f32>,
        side: usize,
        activation: Activation,
    ) -> Self {
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
            inputs: each / (side * side).max(1),
            side,
            activation,
        }
    }

    /// The result for planes of as many channels as the layer has inputs.
    pub(super) fn apply(&self, planes: &Planes) -> Planes {
        self.rows(planes, 1)
    }

    /// Every `step`th row of the result.
    fn rows(&self, planes: &Planes, step: usize) -> Planes {
        let mut result = Planes::zeros(self.biases.len(), (planes.width, planes.height / step));
        let padded = planes.padded(self.side / 2);
        filled(self, &padded, step, &mut result);
        result
    }

    #[inline(always)]
    fn fill_by<const SIDE: usize, const AREA: usize, const SEEN: usize>(
        &self,
        padded: &Planes,
        step: usize,
        result: &mut Planes,
    ) {
        let each = self.inputs * AREA;
        let (width, area) = (result.width, result.area());
        for y in 0..result.height {
            for (group, weights) in self.weights.chunks_exact(each.max(1)).enumerate() {
                let first = group * CHANNELS;
                for x in (0..width).step_by(COLUMNS) {
                    let sums = sums::<SIDE, AREA, SEEN>(weights, padded, x, (y + 1) * step - 1);
                    let many = COLUMNS.min(width - x);
                    let biases = self.biases[first..].iter();
                    for (channel, (sums, bias)) in sums.iter().zip(biases).enumerate() {
                        let begin = (first + channel) * area + y * width + x;
                        let values = &mut result.values[begin..begin + many];
                        for (value, sum) in values.iter_mut().zip(sums) {
                            *value = self.activation.apply(sum + bias);
                        }
                    }
                }
            }
        }
    }
}

impl Filling for Convolution {
    #[inline(always)]
    fn fill(&self, padded: &Planes, step: usize, result: &mut Planes) {
        if self.side == 1 {
            self.fill_by::<1, 1, COLUMNS>(padded, step, result);
        } else {
            self.fill_by::<3, 9, { COLUMNS + 2 }>(padded, step, result);
        }
    }
}

/// A convolution of each channel for itself, with zeros around the planes.
#[derive(Debug)]
pub(super) struct Depthwise {
    /// For each channel, row and column.
    weights: Vec<f32>,
    biases: Vec<f32>,
    /// It sees so many columns and rows, an odd number.
    side: usize,
    /// Whether only every second column and row is wanted, from the second on.
    halves: bool,
}

impl Depthwise {
    /// `weights` in the order channel, row, column; one of `biases` a channel.
    pub(super) fn new(weights: Vec<f32>, biases: Vec<f32>, side: usize, halves: bool) -> Self {
        Self {
            weights,
            biases,
            side,
            halves,
        }
    }

    /// The result, 0..=6, for planes of as many channels.
    fn apply(&self, planes: &Planes) -> Planes {
        let padded = planes.padded(self.side / 2);
        let step = 1 + usize::from(self.halves);
        let mut result = Planes::zeros(self.biases.len(), (planes.width, planes.height / step));
        filled(self, &padded, step, &mut result);
        if self.halves {
            result.every_second_column()
        } else {
            result
        }
    }
}

impl Filling for Depthwise {
    #[inline(always)]
    fn fill(&self, padded: &Planes, step: usize, result: &mut Planes) {
        let (side, width, area) = (self.side, result.width.max(1), result.area().max(1));
        let kernels = self.weights.chunks_exact((side * side).max(1));
        let planes = padded.values.chunks_exact(padded.area().max(1));
        let results = result.values.chunks_exact_mut(area);
        for ((plane, result), (kernel, bias)) in planes.zip(results).zip(kernels.zip(&self.biases))
        {
            for (y, row) in result.chunks_exact_mut(width).enumerate() {
                row.fill(*bias);
                let rows = plane.chunks_exact(padded.width).skip((y + 1) * step - 1);
                for (seen, weights) in rows.zip(kernel.chunks_exact(side.max(1))) {
                    for (column, weight) in weights.iter().enumerate() {
                        for (sum, value) in row.iter_mut().zip(&seen[column..]) {
                            *sum += weight * value;
                        }
                    }
                }
                for value in row {
                    *value = Activation::Relu6.apply(*value);
                }
            }
        }
    }
}

/// Many channels for a while, and a convolution that sees each for itself (Sandler et al., "MobileNetV2", 2018).
#[derive(Debug)]
pub(super) struct Bottleneck {
    pub(super) expand: Option<Convolution>,
    pub(super) depthwise: Depthwise,
    pub(super) project: Convolution,
}

impl Bottleneck {
    fn apply(&self, planes: Planes) -> Planes {
        let wide = self.expand.as_ref().map(|expand| expand.apply(&planes));
        let wide = self.depthwise.apply(wide.as_ref().unwrap_or(&planes));
        let result = self.project.apply(&wide);
        if self.depthwise.halves || result.channels() != planes.channels() {
            return result;
        }
        result.plus(&planes)
    }
}

/// A step from planes to others.
#[derive(Debug)]
pub(super) enum Layer {
    Plain(Convolution),
    /// Of the result every second column and row is kept, from the second on.
    Halving(Convolution),
    /// What the convolutions make of the planes is added to them.
    Residual([Convolution; 2]),
    Bottleneck(Bottleneck),
}

impl Layer {
    pub(super) fn apply(&self, planes: Planes) -> Planes {
        match self {
            Self::Plain(convolution) => convolution.apply(&planes),
            Self::Halving(convolution) => convolution.rows(&planes, 2).every_second_column(),
            Self::Residual([first, second]) => second.apply(&first.apply(&planes)).plus(&planes),
            Self::Bottleneck(bottleneck) => bottleneck.apply(planes),
        }
    }

    /// Whether the result has half the size.
    pub(super) fn halves(&self) -> bool {
        match self {
            Self::Plain(_) | Self::Residual(_) => false,
            Self::Halving(_) => true,
            Self::Bottleneck(bottleneck) => bottleneck.depthwise.halves,
        }
    }
}

/// The weighted sums of a group of channels for a group of columns from `x` on.
#[inline(always)]
fn sums<const SIDE: usize, const AREA: usize, const SEEN: usize>(
    weights: &[[f32; CHANNELS]],
    padded: &Planes,
    x: usize,
    y: usize,
) -> [[f32; COLUMNS]; CHANNELS] {
    let mut sums = [[0.0_f32; COLUMNS]; CHANNELS];
    let planes = padded.values.chunks_exact(padded.area());
    let kernels = weights.as_chunks::<AREA>().0;
    for (plane, kernel) in planes.zip(kernels) {
        for (row, kernel) in kernel.as_chunks::<SIDE>().0.iter().enumerate() {
            let begin = (y + row) * padded.width + x;
            let Some(values) = plane[begin..].first_chunk::<SEEN>() else {
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
        let result = Convolution::new(&weights, biases.clone(), 3, Activation::None).apply(&planes);
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
        let convolution = |bias: f32, activation| {
            Convolution::new(&[0.0; 3 * 3 * 9], vec![bias; 3], 3, activation)
        };
        let layer = Layer::Residual([
            convolution(1.0, Activation::Relu),
            convolution(-0.5, Activation::None),
        ]);
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

    #[test]
    fn a_depthwise_convolution_sees_each_channel_for_itself() {
        let planes = Planes {
            values: numbers(2 * 6 * 4),
            width: 6,
            height: 4,
        };
        let (weights, biases) = (numbers(2 * 9), vec![3.0, -0.1]);
        // The same as a convolution whose other weights are zero.
        let zeros = [0.0; 9];
        let all = [&weights[..9], &zeros, &zeros, &weights[9..]].concat();
        let whole = Convolution::new(&all, biases.clone(), 3, Activation::Relu6).apply(&planes);
        // Of six columns and four rows.
        let odd = [7, 9, 11, 19, 21, 23];
        let half = Planes {
            values: [0, 24]
                .iter()
                .flat_map(|plane| odd.map(|at| whole.values[plane + at]))
                .collect(),
            width: 3,
            height: 2,
        };
        for (halves, wanted) in [(false, whole), (true, half)] {
            let layer = Depthwise::new(weights.clone(), biases.clone(), 3, halves);
            let found = layer.apply(&planes);
            assert_eq!((found.width, found.height), (wanted.width, wanted.height));
            let mut pairs = found.values.iter().zip(&wanted.values);
            assert!(pairs.all(|(found, wanted)| (found - wanted).abs() < 1e-5));
        }
    }

    #[test]
    fn a_wide_depthwise_convolution_sees_two_pixels_on_each_side() {
        let ones = Planes {
            values: vec![1.0; 35],
            width: 7,
            height: 5,
        };
        let layer = Depthwise::new(vec![0.1; 25], vec![0.0], 5, false);
        let found = layer.apply(&ones);
        for (at, count) in [(0, 9.0), (3, 15.0), (17, 25.0), (34, 9.0)] {
            assert!((found.values[at] - 0.1 * count).abs() < 1e-5, "{at}");
        }
    }

    #[test]
    fn a_bottleneck_adds_to_its_planes_unless_it_halves_them() {
        let planes = Planes {
            values: numbers(2 * 4 * 4),
            width: 4,
            height: 4,
        };
        let bottleneck = |halves| Bottleneck {
            expand: Some(Convolution::new(
                &[0.0; 4],
                vec![9.0; 2],
                1,
                Activation::Relu6,
            )),
            depthwise: Depthwise::new(
                [[0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]; 2].concat(),
                vec![0.0; 2],
                3,
                halves,
            ),
            project: Convolution::new(&[1.0, 0.0, 0.0, 0.5], vec![0.0; 2], 1, Activation::None),
        };
        let sum = Layer::Bottleneck(bottleneck(false)).apply(planes.clone());
        assert!((sum.values[0] - planes.values[0] - 6.0).abs() < 1e-6);
        assert!((sum.values[31] - planes.values[31] - 3.0).abs() < 1e-6);
        let layer = Layer::Bottleneck(bottleneck(true));
        assert!(layer.halves());
        assert_eq!(layer.apply(planes).values, [[6.0; 4], [3.0; 4]].concat());
    }
}
