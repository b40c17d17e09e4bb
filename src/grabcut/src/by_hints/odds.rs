//! What a small network says of a picture and hints: which pixels are the object that a person means.
//!
//! It sees the part of the picture around a rectangle, or all of it, in a square of [`SIDE`] pixels. The planes, in this
//! order:
//!
//! | planes | what |
//! | --- | --- |
//! | 3 | red, green and blue, 0..=1 |
//! | 2 | what is surely object, and surely background, 0..=1 |
//! | 1 | where the picture is |
//! | 2 | how much more often a colour is seen elsewhere than in the sure background, in histograms of 8 and of 16 levels a channel |
//! | 1 | how much more often it is seen in the sure object than elsewhere, of 8 levels |
//! | 2 | the column and the row, -1..=1 |

use std::ops::Range;

use image::imageops::{FilterType, crop_imm, resize};
use image::{GrayImage, ImageBuffer, Luma, Pixel, Rgb, RgbImage};
use relit_data::geometry::Rect;

use crate::cut::grab_cut::Label;
use crate::cut::pyramid::{Pyramid, shrunk};
use crate::unet::{LEVELS, Network, Planes};

/// Width and height of what the network sees, pixels: a multiple of 2 to the power of [`LEVELS`].
const SIDE: usize = 192;
const _: () = assert!(SIDE.is_multiple_of(1 << LEVELS));
/// What is around a rectangle is seen within this share of its longer side.
const AROUND: f64 = 0.3;
/// How many planes there are.
const PLANES: usize = 11;
/// Bits of a channel that the coarser histograms distinguish.
const COARSE: u32 = 3;
/// And the finer one.
const FINE: u32 = 4;
/// Added to the shares of a colour, so that one that is not seen is rare.
const RARE: f32 = 1e-4;
/// The logarithm of a ratio of shares that counts as 1.
const MAX_RATIO: f32 = 5.0;

/// The weights of the layers.
const WEIGHTS: &[u8] = include_bytes!("weights.safetensors");
/// The logarithm of odds that are certain.
const MAX_LOG_ODDS: f32 = 8.0;

/// The logarithms of the odds that a pixel shows the object.
#[derive(Debug)]
struct Odds {
    /// The part of the picture that the network saw.
    part: Rect,
    /// Its width and height as the network saw it.
    size: (usize, usize),
    values: Vec<f32>,
}

/// The logarithms of the odds that each pixel of the pyramid's coarsest size shows the object that is meant; certainly not,
/// outside of what the network sees.
pub(crate) fn odds(pyramid: &Pyramid<'_>, rect: Option<Rect>) -> Vec<f32> {
    let coarsest = pyramid.coarsest();
    let part = part(pyramid.size(), rect);
    let (level, seen) = pyramid.smallest(part, |part| part.w.max(part.h) as usize >= SIDE);
    let (width, height) = level.image.dimensions();
    let part = shrunk(part, seen).clipped_to(width, height);
    let odds = part
        .zip(Network::read(WEIGHTS))
        .map(|(part, network)| Odds::new(&network, &level.image, &level.labels, part));
    odds.map_or_else(Vec::new, |odds| {
        odds.at(coarsest.size(), pyramid.halvings() - seen)
    })
}

/// The part of a picture that the network sees.
fn part((width, height): (u32, u32), rect: Option<Rect>) -> Rect {
    let whole = Rect::new(0, 0, width, height);
    let Some(rect) = rect else { return whole };
    let around = (AROUND * f64::from(rect.w.max(rect.h))).ceil() as u32;
    rect.grown(around)
        .clipped_to(width, height)
        .unwrap_or(whole)
}

impl Odds {
    /// Of a part of a picture. `labels` say what is sure in the whole picture.
    fn new(network: &Network, image: &RgbImage, labels: &[Label], part: Rect) -> Self {
        let (seen, (width, height)) = seen(image, labels, part);
        let logits = network.apply(seen);
        let rows = logits.values.chunks_exact(SIDE).take(height);
        Self {
            part,
            size: (width, height),
            values: rows.flat_map(|row| &row[..width]).copied().collect(),
        }
    }

    /// For each pixel of the picture after it was halved so often.
    fn at(&self, (columns, rows): (usize, usize), halvings: usize) -> Vec<f32> {
        let shown = shrunk(self.part, halvings);
        let along = |count: usize, begin: i32, length: u32, shown: Range<i64>, to: usize| {
            let place = |at: usize| {
                shown.contains(&(at as i64)).then(|| {
                    let place = (at as f64 + 0.5) * f64::from(1_u32 << halvings) - f64::from(begin);
                    let place = place * to as f64 / f64::from(length) - 0.5;
                    let place = place.clamp(0.0, (to - 1) as f64);
                    let low = place as usize;
                    (low, (low + 1).min(to - 1), (place - low as f64) as f32)
                })
            };
            (0..count).map(place).collect::<Vec<_>>()
        };
        let Rect { x, y, w, h } = self.part;
        let across = along(
            columns,
            x,
            w,
            i64::from(shown.x)..shown.right(),
            self.size.0,
        );
        let down = along(rows, y, h, i64::from(shown.y)..shown.bottom(), self.size.1);
        let mixed = |row: usize, (left, right, share): (usize, usize, f32)| {
            let row = &self.values[row * self.size.0..];
            row[left] + share * (row[right] - row[left])
        };
        let each = down.iter().flat_map(|row| {
            across.iter().map(move |column| {
                let ((above, below, share), column) = ((*row)?, (*column)?);
                let (above, below) = (mixed(above, column), mixed(below, column));
                Some(above + share * (below - above))
            })
        });
        let most = |odds: f32| odds.clamp(-MAX_LOG_ODDS, MAX_LOG_ODDS);
        each.map(|odds| odds.map_or(-MAX_LOG_ODDS, most)).collect()
    }
}

/// The planes of a part of a picture, and its width and height in them. `labels` say what is sure in the whole picture.
fn seen(image: &RgbImage, labels: &[Label], part: Rect) -> (Planes, (usize, usize)) {
    let scale = SIDE as f64 / f64::from(part.w.max(part.h));
    let small = |side: u32| ((f64::from(side) * scale).round() as u32).max(1);
    let (width, height) = (small(part.w), small(part.h));
    let (left, top) = (part.x as u32, part.y as u32);
    let rgb = crop_imm(image, left, top, part.w, part.h).to_image();
    let rgb = resized(&rgb, (width, height));
    let sure = |wanted: Label| {
        let level = |x: u32, y: u32| {
            let at = (top + y) as usize * image.width() as usize + (left + x) as usize;
            Luma([u8::from(labels[at] == wanted) * 255])
        };
        resized(&GrayImage::from_fn(part.w, part.h, level), (width, height))
    };
    let planes = observed(&rgb, &sure(Label::Object), &sure(Label::Background));
    (planes, (width as usize, height as usize))
}

/// An image at another size: a smaller pixel is the mean of the area that it covers, a larger one is interpolated.
fn resized<P: Pixel<Subpixel = u8> + 'static>(
    image: &ImageBuffer<P, Vec<u8>>,
    (width, height): (u32, u32),
) -> ImageBuffer<P, Vec<u8>> {
    if width >= image.width() {
        return resize(image, width, height, FilterType::Triangle);
    }
    let (across, down) = (
        covered(image.width(), width),
        covered(image.height(), height),
    );
    let mut small: ImageBuffer<P, Vec<u8>> = ImageBuffer::new(width, height);
    for ((x, y), pixel) in (0..height)
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .zip(small.pixels_mut())
    {
        let (columns, rows) = (&across[x as usize], &down[y as usize]);
        let mut sums = [0.0_f32; 4];
        for &(row, of_row) in rows {
            for &(column, of_column) in columns {
                let levels = image.get_pixel(column, row).channels();
                for (sum, &level) in sums.iter_mut().zip(levels) {
                    *sum += of_row * of_column * f32::from(level);
                }
            }
        }
        for (level, sum) in pixel.channels_mut().iter_mut().zip(sums) {
            *level = sum.round() as u8;
        }
    }
    small
}

/// For each of `to` pixels in a row the pixels of `from` that it covers, with their shares of it.
fn covered(from: u32, to: u32) -> Vec<Vec<(u32, f32)>> {
    let scale = f64::from(from) / f64::from(to);
    let of = |at: u32| {
        let (begin, end) = (f64::from(at) * scale, f64::from(at + 1) * scale);
        let last = (end.ceil() as u32).min(from);
        let share = |pixel: u32| {
            let (left, right) = (f64::from(pixel), f64::from(pixel + 1));
            ((right.min(end) - left.max(begin)) / scale) as f32
        };
        (begin as u32..last)
            .map(|pixel| (pixel, share(pixel)))
            .collect()
    };
    (0..to).map(of).collect()
}

/// The planes of a picture and of what is surely object and background in it.
fn observed(rgb: &RgbImage, object: &GrayImage, background: &GrayImage) -> Planes {
    let mut planes = Planes::zeros(PLANES, (SIDE, SIDE));
    let width = rgb.width() as usize;
    let mut fill = |plane: usize, value: &dyn Fn(usize) -> f32| {
        for at in 0..rgb.as_raw().len() / 3 {
            planes.values[(plane * SIDE + at / width) * SIDE + at % width] = value(at);
        }
    };
    let (levels, object, background) = (rgb.as_raw(), object.as_raw(), background.as_raw());
    for channel in 0..3 {
        fill(channel, &|at| f32::from(levels[3 * at + channel]) / 255.0);
    }
    fill(3, &|at| f32::from(object[at]) / 255.0);
    fill(4, &|at| f32::from(background[at]) / 255.0);
    fill(5, &|_| 1.0);
    let is_background = |at: usize| background[at] > 127;
    let is_object = |at: usize| object[at] > 63;
    let coarse = Colours::new(rgb, COARSE);
    let fine = Colours::new(rgb, FINE);
    for (plane, colours) in [(6, &coarse), (7, &fine)] {
        let ratios = colours.ratios(|at| !is_background(at));
        fill(plane, &|at| ratios[at]);
    }
    let ratios = coarse.ratios(is_object);
    fill(8, &|at| ratios[at]);
    let place = |at: usize| 2.0 * at as f32 / (SIDE - 1) as f32 - 1.0;
    for at in 0..SIDE * SIDE {
        planes.values[9 * SIDE * SIDE + at] = place(at % SIDE);
        planes.values[10 * SIDE * SIDE + at] = place(at / SIDE);
    }
    planes
}

/// The colour of each pixel, as a number.
struct Colours {
    of: Vec<usize>,
    bits: u32,
}

impl Colours {
    fn new(rgb: &RgbImage, bits: u32) -> Self {
        let number = |pixel: &Rgb<u8>| {
            let levels = pixel.0.iter();
            levels.fold(0, |number, &level| {
                number << bits | usize::from(level) >> (8 - bits)
            })
        };
        Self {
            of: rgb.pixels().map(number).collect(),
            bits,
        }
    }

    /// The logarithms of how much more often each pixel's colour is seen in the first part than in the rest, -1..=1;
    /// zeros if either is empty.
    fn ratios(&self, is_first: impl Fn(usize) -> bool) -> Vec<f32> {
        let mut counts: [_; 2] = std::array::from_fn(|_| vec![0_u32; 1 << (3 * self.bits)]);
        for (at, &colour) in self.of.iter().enumerate() {
            counts[usize::from(is_first(at))][colour] += 1;
        }
        let [rest, first] = counts;
        let all = |counts: &[u32]| counts.iter().sum::<u32>() as f32;
        let (all_rest, all_first) = (all(&rest), all(&first));
        if all_rest == 0.0 || all_first == 0.0 {
            return vec![0.0; self.of.len()];
        }
        let ratio = |&colour: &usize| {
            let first = first[colour] as f32 / all_first + RARE;
            let rest = rest[colour] as f32 / all_rest + RARE;
            ((first / rest).ln() / MAX_RATIO).clamp(-1.0, 1.0)
        };
        self.of.iter().map(ratio).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where planes and odds are compared: column and row.
    const PLACES: [(usize, usize); 3] = [(7, 5), (90, 75), (120, 130)];
    const RECT: Rect = Rect::new(40, 50, 110, 90);

    /// A pattern, a rectangle in it, and a mark.
    fn pattern() -> (RgbImage, Vec<Label>) {
        let side = SIDE as u32;
        let image = RgbImage::from_fn(side, side, |x, y| {
            let level = |channel: u32| {
                let steps = x * y / 7 + 60 * (x / 48) * channel;
                ((3 * x + y * (5 + channel) + steps) % 256) as u8
            };
            Rgb([level(0), level(1), level(2)])
        });
        let label = |at: usize| {
            let (x, y) = (at % SIDE, at / SIDE);
            if (70..100).contains(&x) && (80..90).contains(&y) {
                Label::Object
            } else if RECT.contains(at, side) {
                Label::ProbablyObject
            } else {
                Label::Background
            }
        };
        (image, (0..SIDE * SIDE).map(label).collect())
    }

    /// The numbers are those of `tests/bench/photo_network.py parity`.
    #[test]
    fn planes_and_odds_are_those_of_the_training() {
        let (image, labels) = pattern();
        let part = part(image.dimensions(), Some(RECT));
        assert_eq!(part, Rect::new(7, 17, 176, 156));
        let seen = seen(&image, &labels, part).0;
        for (plane, wanted) in PLANES_SEEN {
            for ((x, y), wanted) in PLACES.into_iter().zip(wanted) {
                let found = seen.values[(plane * SIDE + y) * SIDE + x];
                assert!(
                    (found - wanted).abs() < 0.05,
                    "{plane}: {found} for {wanted}"
                );
            }
        }
        let network = Network::read(WEIGHTS).unwrap();
        let odds = Odds::new(&network, &image, &labels, part);
        for ((x, y), wanted) in PLACES.into_iter().zip(ODDS) {
            let found = odds.values[y * odds.size.0 + x];
            assert!((found - wanted).abs() < 0.5, "{found} for {wanted}");
        }
    }

    const PLANES_SEEN: [(usize, [f32; 3]); 7] = [
        (0, [0.741, 0.647, 0.925]),
        (2, [0.910, 0.141, 0.929]),
        (3, [0.000, 1.000, 0.000]),
        (4, [1.000, 0.000, 0.000]),
        (6, [-0.501, -0.062, 0.107]),
        (7, [-0.397, 0.161, 0.134]),
        (8, [-0.785, 0.198, -0.537]),
    ];
    const ODDS: [f32; 3] = [-9.601, 4.576, -1.307];

    #[test]
    fn odds_of_a_part_lie_where_it_is_and_are_certain_outside() {
        let odds = Odds {
            part: Rect::new(4, 0, 8, 4),
            size: (2, 1),
            values: vec![-1.0, 3.0],
        };
        let found = odds.at((8, 2), 1);
        let row = [-8.0, -8.0, -1.0, 0.0, 2.0, 3.0, -8.0, -8.0];
        assert_eq!(found, [row, row].concat());
        // The last pixel of a side that was odd.
        let odd = Odds {
            part: Rect::new(2, 0, 3, 1),
            size: (1, 1),
            values: vec![2.0],
        };
        assert_eq!(odd.at((3, 1), 1), [-8.0, 2.0, 2.0]);
    }

    #[test]
    fn a_smaller_pixel_is_the_mean_of_what_it_covers() {
        let image = GrayImage::from_raw(3, 1, vec![0, 90, 255]).unwrap();
        assert_eq!(resized(&image, (2, 1)).into_raw(), [30, 200]);
        assert_eq!(resized(&image, (1, 1)).into_raw(), [115]);
    }

    #[test]
    fn what_a_network_sees_is_whole_at_the_borders() {
        let whole = Rect::new(0, 0, 30, 20);
        assert_eq!(part((30, 20), None), whole);
        assert_eq!(part((30, 20), Some(Rect::new(1, 1, 28, 18))), whole);
        let far = Rect::new(i32::MAX - 5, 3, 4, 4);
        assert_eq!(part((30, 20), Some(far)), whole);
    }

    #[test]
    fn colours_of_one_part_alone_have_the_largest_ratio() {
        let image = RgbImage::from_fn(4, 1, |x, _| Rgb([if x < 2 { 10 } else { 240 }; 3]));
        let colours = Colours::new(&image, COARSE);
        assert_eq!(colours.ratios(|at| at < 2), [1.0, 1.0, -1.0, -1.0]);
        assert_eq!(colours.ratios(|_| true), [0.0; 4]);
    }
}
