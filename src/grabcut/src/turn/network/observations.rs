//! What the frames of a turn show at each pixel, as the network sees it.
//!
//! Luma is that of the sRGB levels. Logarithms of it are of the mean over three by three pixels. The planes, in this order:
//!
//! | planes | what |
//! | --- | --- |
//! | 3 | the mean red, green and blue, 0..=1 |
//! | 2 | the least and the largest luma |
//! | 2 | ln(1 + 100 s) / 4, where s is the standard deviation of luma, and of the differences red - green and blue - green together |
//! | 4 | cosine and sine of the first two harmonics of the logarithm, from -2 to 2 |
//! | 2 | the residual of the logarithm: ln(1 + 100 s) / 5, and its share of the variance |
//! | 1 | the share of the frames in which the pixel is white |
//! | 2 | an edge to the right, and one below: the mean square of the step of the logarithm, in steps of 0.05, each at most 1 |
//! | 2 | ln(1 + 50 s) / 3, where s is the standard deviation of these steps |
//! | 2 | the column and the row, -1..=1 |

use image::RgbImage;

use crate::turn::smooth::smooth;
use crate::unet::Planes;

/// How many planes there are.
pub(super) const PLANES: usize = 20;
/// Harmonics of the table's angle.
const ORDER: usize = 2;
const HARMONICS: usize = 2 * ORDER;
/// Added to a luma, 0..=1, before its logarithm: noise counts little below.
const DARK: f32 = 0.02;
/// A step of the logarithm that is an edge.
const EDGE: f32 = 0.05;
/// A pixel is white where all channels have at least this level.
const WHITE: u8 = 250;
/// Keeps the share of a variance defined if a pixel does not change.
const NO_CHANGE: f32 = 1e-5;
/// A larger amplitude of a harmonic counts as this.
const MAX_AMPLITUDE: f32 = 2.0;

/// Sums over the frames at one pixel.
#[derive(Debug, Clone, Copy)]
struct Sums {
    colour: [f32; 3],
    least: f32,
    largest: f32,
    luma: Moments,
    red_green: Moments,
    blue_green: Moments,
    log: Moments,
    harmonics: [f32; HARMONICS],
    white: f32,
    edges: [f32; 2],
    steps: [Moments; 2],
}

/// The sums of a number and of its square, exact enough for their small difference.
#[derive(Debug, Clone, Copy, Default)]
struct Moments([f64; 2]);

impl Moments {
    fn add(&mut self, value: f32) {
        let value = f64::from(value);
        self.0[0] += value;
        self.0[1] += value * value;
    }

    fn variance(self, many: f32) -> f32 {
        let [mean, square] = self.0.map(|sum| sum / f64::from(many));
        (square - mean * mean).max(0.0) as f32
    }
}

impl Sums {
    const NONE: Self = Self {
        colour: [0.0; 3],
        least: 1.0,
        largest: 0.0,
        luma: Moments([0.0; 2]),
        red_green: Moments([0.0; 2]),
        blue_green: Moments([0.0; 2]),
        log: Moments([0.0; 2]),
        harmonics: [0.0; HARMONICS],
        white: 0.0,
        edges: [0.0; 2],
        steps: [Moments([0.0; 2]); 2],
    };

    fn add(&mut self, levels: [u8; 3], luma: f32) {
        let colour = levels.map(|level| f32::from(level) / 255.0);
        let [red, green, blue] = colour;
        self.colour
            .iter_mut()
            .zip(colour)
            .for_each(|(sum, value)| *sum += value);
        self.least = self.least.min(luma);
        self.largest = self.largest.max(luma);
        self.luma.add(luma);
        self.red_green.add(red - green);
        self.blue_green.add(blue - green);
        self.white += f32::from(u8::from(levels.iter().all(|&level| level >= WHITE)));
    }

    fn add_log(&mut self, log: f32, basis: &[f32; HARMONICS], steps: [f32; 2]) {
        self.log.add(log);
        self.harmonics
            .iter_mut()
            .zip(basis)
            .for_each(|(sum, wave)| *sum += wave * log);
        for (at, step) in steps.into_iter().enumerate() {
            self.edges[at] += (step / EDGE).powi(2).min(1.0);
            self.steps[at].add(step);
        }
    }

    /// All planes but the last two.
    fn finish(&self, many: f32) -> [f32; PLANES - 2] {
        let spread =
            |variance: f32, scale: f32, most: f32| (scale * variance.sqrt()).ln_1p() / most;
        let [red, green, blue] = self.colour.map(|sum| sum / many);
        let harmonics = self.harmonics.map(|sum| 2.0 * sum / many);
        let fitted: f32 = harmonics.iter().map(|wave| wave * wave / 2.0).sum();
        let all = self.log.variance(many);
        let residual = (all - fitted).max(0.0);
        let [first, second, third, fourth] =
            harmonics.map(|wave| wave.clamp(-MAX_AMPLITUDE, MAX_AMPLITUDE));
        let colours = self.red_green.variance(many) + self.blue_green.variance(many);
        let [right, below] = self.edges.map(|sum| sum / many);
        let [across, down] = self
            .steps
            .map(|steps| spread(steps.variance(many), 50.0, 3.0));
        [
            red,
            green,
            blue,
            self.least,
            self.largest,
            spread(self.luma.variance(many), 100.0, 4.0),
            spread(colours, 100.0, 4.0),
            first,
            second,
            third,
            fourth,
            spread(residual, 100.0, 5.0),
            (residual + NO_CHANGE) / (all + NO_CHANGE),
            self.white / many,
            right,
            below,
            across,
            down,
        ]
    }
}

/// The planes for frames of one size, spread evenly over a turn, with zeros on the right and below up to a size of whole
/// multiples of `unit`.
pub(super) fn observe(frames: &[RgbImage], unit: usize) -> Planes {
    let (width, height) = frames.first().map_or((0, 0), RgbImage::dimensions);
    let (width, height) = (width as usize, height as usize);
    let mut sums = vec![Sums::NONE; width * height];
    for (number, frame) in frames.iter().enumerate() {
        let angle = std::f32::consts::TAU * number as f32 / frames.len() as f32;
        let basis = std::array::from_fn(|wave| {
            let (sin, cos) = (angle * (wave / 2 + 1) as f32).sin_cos();
            if wave % 2 == 0 { cos } else { sin }
        });
        let luma: Vec<f32> = frame.pixels().map(|pixel| luma(pixel.0)).collect();
        let logs: Vec<f32> = smooth(&luma, (width, height))
            .into_iter()
            .map(|mean| (mean + DARK).ln())
            .collect();
        for ((at, sums), pixel) in sums.iter_mut().enumerate().zip(frame.pixels()) {
            let step = |is_there: bool, by: usize| {
                if is_there {
                    logs[at + by] - logs[at]
                } else {
                    0.0
                }
            };
            let steps = [
                step(at % width + 1 < width, 1),
                step(at / width + 1 < height, width),
            ];
            sums.add(pixel.0, luma[at]);
            sums.add_log(logs[at], &basis, steps);
        }
    }
    let size = (width.next_multiple_of(unit), height.next_multiple_of(unit));
    let mut planes = Planes::zeros(PLANES, size);
    let area = planes.area();
    for (at, sums) in sums.iter().enumerate() {
        let to = at / width * size.0 + at % width;
        for (plane, value) in sums.finish(frames.len() as f32).into_iter().enumerate() {
            planes.values[plane * area + to] = value;
        }
    }
    let place = |at: usize, side: usize| 2.0 * at as f32 / (side - 1).max(1) as f32 - 1.0;
    for at in 0..area {
        planes.values[(PLANES - 2) * area + at] = place(at % size.0, size.0);
        planes.values[(PLANES - 1) * area + at] = place(at / size.0, size.1);
    }
    planes
}

fn luma([red, green, blue]: [u8; 3]) -> f32 {
    (0.299 * f32::from(red) + 0.587 * f32::from(green) + 0.114 * f32::from(blue)) / 255.0
}
