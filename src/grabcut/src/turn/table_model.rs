//! How the table's colour changes over a turn, and which pixels behave like it.
//!
//! Every pixel of the table is lit by the same light and differs by shadows and reflections only, so that the courses
//! of all lie near a space of few dimensions. It is learned from what surely is table. How far a pixel is from it, in
//! units of how far the table's own pixels are, is evidence: against the same of the object's own pixels, so that a
//! black object is not lost.

use crate::bitmap::{Bitmap, Connectivity};

use super::disc::Disc;
use super::pixel_series::PixelSeries;
use super::subspace::Subspace;

/// Principal directions beside the mean: of the plain surface, and of all of the table.
const SURFACE_DIRECTIONS: usize = 6;
const DIRECTIONS: usize = 4;
/// The share of what may be table that is furthest from the plain surface, and is not learned from.
const LEFT_OUT: f64 = 0.2;
/// Most pixels from which the space is learned, and the least.
const MAX_SAMPLES: usize = 2500;
const MIN_SAMPLES: usize = 300;
/// The table is at most so many times as bright, and changes so many times as much, as the brightest of what surely is
/// table.
const BRIGHTER: f32 = 2.0;
/// Which part of what surely is table is at most as bright.
const BRIGHTEST: f64 = 0.95;
/// Without a plain surface, what lies below the object and is darker than this share of the scene's white is table.
const DARK: f32 = 0.25;
/// The scene's white is what this share of it is at most as bright as.
const WHITE: f64 = 0.9;
/// Share of the height by which what surely is below the object begins above its foot.
const FOOT: f64 = 0.04;
/// Parts of the object that are at most twice so many pixels wide may be the table's rim.
const THIN: usize = 2;
/// Share of the width that keeps the table's pixels away from the object.
const AWAY: f64 = 0.006;
/// Of what was learned from, this share is at most as bright as the table without shade.
const LIT: f64 = 0.75;
/// A part of the table that is darker by this logarithm is in shade.
const SHADE: f32 = 0.1;
/// The brightest frames of a pixel are one of so many.
const FEW_FRAMES: usize = 8;
/// A luminance, 0..=1, that noise hides.
const NOISE: f32 = 0.001;
/// Units of the density for one of the logarithm of the brightness.
const BRIGHTNESS: f32 = 2.0;

/// What is as bright as the unshaded table differs from its middle by at most so many times its spread.
const AS_BRIGHT: f32 = 2.5;
/// And is more likely the table by at least this logarithm.
const LIKELY: f32 = 1.0;

/// What is like the unshaded table differs from its middle by at most so many spreads.
const SAME: f32 = 1.2;
/// And its brightness is less likely the object's, as a logarithm.
const NOT_OBJECT: f32 = -1.0;

/// The logarithm of the distance is counted in bins of this width, from here on.
const BIN: f32 = 0.25;
const FIRST_BIN: f32 = -2.0;
const BINS: usize = 36;
/// The spread of the table's logarithm of the distance, at least.
const MIN_SPREAD: f32 = 0.2;
/// Openings are in shade, and further from the table than it is on average: the spread is so many times as wide there.
const SHADED: f32 = 2.0;
/// An object is bright if at least a third of it has a measure of its darkness that is smaller than the table's by this.
const FAR_BRIGHTER: f32 = 3.0;
/// Of a bright object one of so many of the pixels that are as dark as the table counts as its own.
const DOUBTED: usize = 4;
/// At most this share of what looks like the object is table.
const MAX_INCLUDED: f32 = 0.6;
/// The object has each distance with at least this density, and so has the table, which an object lights from nearby.
const FLOOR: f32 = 0.01;
const TABLE_FLOOR: f32 = 0.03;
/// The most that the table's model says for the table, in units of the log-likelihood of a pixel.
const STRENGTH: f32 = 8.0;
/// The most that it says for the table that a pixel is not brighter: a dark object is not, either.
const AS_DARK: f32 = 2.0;
/// The table's disc, where the model speaks for the object too, begins so far below the rim, as a share of the image's
/// width.
const RIM: f64 = 0.006;

/// What is known of a turn before the table's model.
pub(crate) struct TurnObservations<'a> {
    /// An object that was found without the model.
    pub(crate) object: &'a Bitmap,
    /// The table's plain surface; may be empty.
    pub(crate) surface: &'a Bitmap,
    /// The average luminance of each pixel, linear.
    pub(crate) light: &'a [f32],
    /// How much its brightness changes.
    pub(crate) change: &'a [f32],
}

/// The table's model over one turn.
#[derive(Debug)]
pub(crate) struct TableModel {
    /// How much more likely each pixel is object than table, as a logarithm.
    pub(crate) ratio: Vec<f32>,
    /// The same by the course alone: a dark part of the object in shade is not brighter than the table, either.
    by_course: Vec<f32>,
    /// The pixels that show the table or the object, and never the room.
    pub(crate) on_disc: Bitmap,
    /// The pixels that are as bright as the unshaded table in their brightest frames, and the object is not.
    as_unshaded: Bitmap,
    /// The pixels that are about as bright as the unshaded table in the frames in which they are brightest.
    as_bright: Bitmap,
    /// Whether a third of the object that was found is far brighter than the table.
    pub(crate) object_is_bright: bool,
    size: (usize, usize),
}

impl TableModel {
    /// Learns the table's space; `None` if no table is seen.
    pub(crate) fn learn(series: &PixelSeries, seen: &TurnObservations<'_>) -> Option<Self> {
        let Candidates { far, surely, table } = candidates(seen, series.size())?;
        let taken = learned_from(series, &surely, &table);
        let samples: Vec<Vec<f32>> = taken.iter().map(|&at| series.smooth(at)).collect();
        let space = Subspace::learn(&samples, DIRECTIONS);
        let unshaded = Unshaded::learn(&samples)?;
        let length = series.length().max(1) as f32;
        let measures = series.map_smooth(|course| {
            let distance = (space.residual(course) / length).sqrt();
            (distance, unshaded.brighter(course))
        });
        let of_table = quantile(taken.iter().map(|&at| measures[at].0), 0.5)?;
        let log = |&(distance, _): &(f32, f32)| (distance / of_table.max(1e-9)).max(1e-3).ln();
        let logs: Vec<f32> = measures.iter().map(log).collect();
        let brighter: Vec<f32> = measures.iter().map(|&(_, by)| by).collect();
        let trend = Trend::learn(&brighter, &taken, series.size().0);
        let darker = brighter.iter().enumerate();
        let darker: Vec<f32> = darker
            .map(|(at, by)| BRIGHTNESS * (trend.at(at) - by))
            .collect();
        let of_table = TableDensity::learn(taken.iter().map(|&at| darker[at]))?;
        let core = seen.object.eroded(2);
        let far_brighter = core.map(|at, bit| bit && darker[at] < of_table.middle - FAR_BRIGHTER);
        let object_is_bright = 3 * far_brighter.count() >= core.count();
        // What is dark in a bright object may be table in its shade, which the first cut took for a part of it.
        let least = of_table.middle - of_table.spread;
        let doubted = |at: usize| object_is_bright && darker[at] > least;
        let core = core.map(|at, bit| bit && (!doubted(at) || is_one_of(at, core.width())));
        let course = LogRatios::learn(&logs, &taken, &core)?;
        let by_brightness = LogRatios::learn(&darker, &taken, &core)?.ratios;
        let off: Vec<f32> = darker
            .iter()
            .map(|darker| (darker - of_table.middle) / of_table.spread)
            .collect();
        let as_bright = far.map(|at, _| off[at].abs() <= AS_BRIGHT);
        let as_unshaded = far.map(|at, _| off[at].abs() <= SAME && by_brightness[at] <= NOT_OBJECT);
        let both = course.ratios.iter().zip(&by_brightness);
        let ratio: Vec<f32> = both
            .map(|(course, brightness)| course + brightness.max(-AS_DARK))
            .collect();
        // What is not table on the disc is object, and the table is never above its rim; below it may be the room, which
        // may be as unlike the table as a black object.
        let seen_table = |is_like: &dyn Fn(usize) -> bool| {
            let alike = far.map(|at, far| far && ratio[at] < 0.0 && is_like(at));
            alike
                .eroded(1)
                .parts_where(Connectivity::Four, |part, pixels| {
                    part.area >= MIN_SAMPLES as u64 && pixels().and(&table).count() > 0
                })
        };
        let size = series.size();
        let fit = |seen: Bitmap| Disc::fit(&seen, &far, size).map(|disc| (seen, disc));
        let rim = fit(seen_table(&|at| course.of_table.has(logs[at])))
            .or_else(|| fit(seen_table(&|_| true)));
        let disc = rim.as_ref().map(|(_, disc)| *disc);
        let on_disc = match &rim {
            Some((seen, disc)) => on_disc(seen, *disc),
            None => far.minus(&far),
        };
        let above = above_rim(&far, disc);
        let ratio = ratio.iter().enumerate().map(|(at, &ratio)| match () {
            () if on_disc.bits()[at] => ratio.clamp(-STRENGTH, STRENGTH),
            () if above.bits()[at] => 0.0,
            () => ratio.clamp(-STRENGTH, 0.0),
        });
        Some(Self {
            ratio: ratio.collect(),
            as_unshaded,
            by_course: course.ratios,
            on_disc,
            as_bright,
            object_is_bright,
            size,
        })
    }

    /// The same of frames of half the size.
    pub(crate) fn halved(&self) -> Self {
        let (width, height) = self.size;
        let half = (width.div_ceil(2), height.div_ceil(2));
        let four = |at: usize| {
            let (x, y) = (at % half.0 * 2, at / half.0 * 2);
            let (right, below) = ((x + 1).min(width - 1), (y + 1).min(height - 1));
            [(x, y), (right, y), (x, below), (right, below)].map(|(x, y)| y * width + x)
        };
        let pixels = half.0 * half.1;
        let mean = |values: &[f32]| -> Vec<f32> {
            let four = (0..pixels).map(four);
            four.map(|four| four.map(|at| values[at]).iter().sum::<f32>() / 4.0)
                .collect()
        };
        let all = |bitmap: &Bitmap| {
            let all = (0..pixels).map(|at| four(at).iter().all(|&at| bitmap.bits()[at]));
            Bitmap::new((half.0 as u32, half.1 as u32), all)
        };
        Self {
            ratio: mean(&self.ratio),
            by_course: mean(&self.by_course),
            on_disc: all(&self.on_disc),
            as_bright: all(&self.as_bright),
            as_unshaded: all(&self.as_unshaded),
            object_is_bright: self.object_is_bright,
            size: half,
        }
    }

    /// The pixels that are more likely table than object by a logarithm of at least this.
    pub(crate) fn alike(&self, least: f32) -> Bitmap {
        self.on_disc.map(|at, _| self.ratio[at] < -least)
    }

    /// What the model takes for the table.
    pub(crate) fn seen(&self) -> SeenTable {
        let by_course = self
            .alike(0.0)
            .map(|at, alike| alike && self.by_course[at] < 0.0);
        SeenTable {
            as_bright: by_course.and(&self.alike(LIKELY)).and(&self.as_bright),
            like: by_course.or(&self.as_unshaded),
        }
    }
}

/// Pixels that a table's model takes for the table.
#[derive(Debug)]
pub(crate) struct SeenTable {
    /// All that are more likely table than object.
    pub(crate) like: Bitmap,
    /// Those that are so for sure by their course, and as bright as the unshaded table.
    pub(crate) as_bright: Bitmap,
}

/// What may be table.
struct Candidates {
    /// What is away from the object.
    far: Bitmap,
    /// What surely is table.
    surely: Bitmap,
    /// What is as dark and still, away from the object, connected with it, and not with the image's upper border.
    table: Bitmap,
}

/// The pixels that may be table: around the plain surface, or without one around what lies below the object.
fn candidates(seen: &TurnObservations<'_>, (width, height): (usize, usize)) -> Option<Candidates> {
    let away = ((width as f64 * AWAY).round() as usize).max(2);
    // Without the table's rim, which may hang on the object.
    let far = seen.object.opened(THIN).dilated(away).inverted();
    let surely = if seen.surface.count() >= MIN_SAMPLES as u64 {
        seen.surface.and(&far)
    } else {
        let foot = seen.object.bounds().bottom() - (height as f64 * FOOT) as i64;
        let white = quantile(seen.light.iter().copied(), WHITE)?;
        far.map(|at, bit| bit && (at / width) as i64 >= foot && seen.light[at] < DARK * white)
    };
    let of_sure = |values: &[f32]| {
        let chosen = surely.bits().iter().zip(values);
        quantile(
            chosen.filter(|(bit, _)| **bit).map(|(_, &value)| value),
            BRIGHTEST,
        )
    };
    let (light, change) = (of_sure(seen.light)?, of_sure(seen.change)?);
    let alike = far.map(|at, bit| {
        bit && seen.light[at] <= BRIGHTER * light && seen.change[at] <= BRIGHTER * change
    });
    let table = alike
        .eroded(1)
        .parts_where(Connectivity::Four, |part, pixels| {
            let is_large = 2 * part.area >= MIN_SAMPLES as u64;
            is_large && part.bounds.y > 2 && 2 * pixels().and(&surely).count() >= MIN_SAMPLES as u64
        });
    (table.count() >= MIN_SAMPLES as u64).then_some(Candidates { far, surely, table })
}

/// Some of what may be table, without the share of it that is least like what surely is: parts of a black object.
fn learned_from(series: &PixelSeries, surely: &Bitmap, table: &Bitmap) -> Vec<usize> {
    let sure: Vec<Vec<f32>> = thinned(surely)
        .iter()
        .map(|&at| series.smooth(at))
        .collect();
    let space = Subspace::learn(&sure, SURFACE_DIRECTIONS);
    let mut taken: Vec<(f32, usize)> = thinned(table)
        .into_iter()
        .map(|at| (space.residual(&series.smooth(at)), at))
        .collect();
    taken.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    taken.truncate((taken.len() as f64 * (1.0 - LEFT_OUT)).ceil() as usize);
    taken.into_iter().map(|(_, at)| at).collect()
}

/// Some of the pixels, spread evenly.
fn thinned(samples: &Bitmap) -> Vec<usize> {
    let step = (samples.count() as usize).div_ceil(MAX_SAMPLES).max(1);
    let set = samples.bits().iter().enumerate().filter(|(_, bit)| **bit);
    set.map(|(at, _)| at).step_by(step).collect()
}

/// The pixels between the table's upper rim and the lowest of it in their column: nothing but the object can hide the
/// table there.
fn on_disc(table: &Bitmap, disc: Disc) -> Bitmap {
    let width = table.width();
    let mut lowest = vec![0; width];
    for (at, _) in table.bits().iter().enumerate().filter(|(_, bit)| **bit) {
        lowest[at % width] = at / width;
    }
    table.map(|at, _| {
        let (x, y) = (at % width, at / width);
        let top = disc.top(x);
        y <= lowest[x] && top.is_some_and(|top| y as f64 >= top + RIM * width as f64)
    })
}

/// The pixels of an image like `like` that are above the table's upper rim; none without a rim that is seen well.
fn above_rim(like: &Bitmap, disc: Option<Disc>) -> Bitmap {
    let width = like.width();
    like.map(|at, _| {
        let top = disc.and_then(|disc| disc.top(at % width));
        top.is_some_and(|top| ((at / width) as f64) < top - RIM * width as f64)
    })
}

/// Whether a pixel is one of so many that are doubted, spread evenly.
fn is_one_of(at: usize, width: usize) -> bool {
    (at / width + at % width).is_multiple_of(DOUBTED)
}

/// How much more likely each pixel is object than table by one measure, as a logarithm.
struct LogRatios {
    of_table: TableDensity,
    ratios: Vec<f32>,
}

impl LogRatios {
    fn learn(values: &[f32], table: &[usize], object: &Bitmap) -> Option<Self> {
        let of_table = TableDensity::learn(table.iter().map(|&at| values[at]))?;
        let core = object.bits().iter().zip(values).filter(|(bit, _)| **bit);
        let of_object = ObjectDensity::learn(core.map(|(_, &value)| value), &of_table);
        let ratio = |&value: &f32| (of_object.at(value) / of_table.at(value)).ln();
        let ratios = values.iter().map(ratio).collect();
        Some(Self { of_table, ratios })
    }
}

/// The luminance of the unshaded table in each frame.
struct Unshaded(Vec<f32>);

impl Unshaded {
    fn learn(samples: &[Vec<f32>]) -> Option<Self> {
        let frames = 0..samples.first()?.len() / 3;
        let of = |frame: usize| {
            let levels = samples.iter().map(|course| luminance_in(course, frame));
            quantile(levels, LIT)
        };
        frames.map(of).collect::<Option<_>>().map(Self)
    }

    /// By how much a pixel is brighter in the frames in which it is so most, as a logarithm. Shade makes the table
    /// darker in some frames, and hardly anything makes it brighter in any.
    fn brighter(&self, course: &[f32]) -> f32 {
        let ratio =
            |(frame, level): (usize, &f32)| (luminance_in(course, frame) + NOISE) / (level + NOISE);
        let mut ratios: Vec<f32> = self.0.iter().enumerate().map(ratio).collect();
        let most = (ratios.len() / FEW_FRAMES).max(1);
        ratios.select_nth_unstable_by(most - 1, |a, b| b.total_cmp(a));
        (ratios[..most].iter().sum::<f32>() / most as f32).ln()
    }
}

/// How a measure of the table depends on the row: it gleams more where it is seen at a smaller angle.
struct Trend {
    middle: [f32; 2],
    slope: f32,
    width: usize,
}

impl Trend {
    /// The line of least squares through those values that are not far below it: those are in shade.
    fn learn(values: &[f32], samples: &[usize], width: usize) -> Self {
        let mut trend = Self {
            middle: [0.0; 2],
            slope: 0.0,
            width,
        };
        for below in [f32::INFINITY, SHADE] {
            let lit = |&&at: &&usize| values[at] > trend.at(at) - below;
            let points: Vec<[f32; 2]> = samples
                .iter()
                .filter(lit)
                .map(|&at| [(at / width) as f32, values[at]])
                .collect();
            let many = points.len().max(1) as f32;
            let middle =
                [0, 1].map(|axis| points.iter().map(|point| point[axis]).sum::<f32>() / many);
            let of = |axis: usize| {
                points
                    .iter()
                    .map(|point| (point[0] - middle[0]) * (point[axis] - middle[axis]))
                    .sum::<f32>()
            };
            trend = Self {
                middle,
                slope: of(1) / of(0).max(1.0),
                width,
            };
        }
        trend
    }

    fn at(&self, at: usize) -> f32 {
        self.middle[1] + self.slope * ((at / self.width) as f32 - self.middle[0])
    }
}

fn luminance_in(course: &[f32], frame: usize) -> f32 {
    let [red, green, blue] = [0, 1, 2].map(|channel| course[3 * frame + channel]);
    0.2126 * red + 0.7152 * green + 0.0722 * blue
}

fn quantile(values: impl Iterator<Item = f32>, share: f64) -> Option<f32> {
    let mut values: Vec<f32> = values.collect();
    let at = ((values.len() as f64 * share) as usize).min(values.len().checked_sub(1)?);
    Some(*values.select_nth_unstable_by(at, f32::total_cmp).1)
}

/// The density of the table's logarithms: a Gaussian, wider above its middle.
struct TableDensity {
    middle: f32,
    spread: f32,
}

impl TableDensity {
    fn learn(logs: impl Iterator<Item = f32>) -> Option<Self> {
        let logs: Vec<f32> = logs.collect();
        let middle = quantile(logs.iter().copied(), 0.5)?;
        let spread = quantile(logs.iter().map(|log| (log - middle).abs()), 0.683)?;
        let spread = spread.max(MIN_SPREAD);
        Some(Self { middle, spread })
    }

    fn at(&self, log: f32) -> f32 {
        let wide = if log > self.middle { SHADED } else { 1.0 };
        let offset = (log - self.middle) / (wide * self.spread);
        let both = self.spread * (1.0 + SHADED) / 2.0;
        (-0.5 * offset * offset).exp() / (both * std::f32::consts::TAU.sqrt()) + TABLE_FLOOR
    }

    /// Whether the table has such values, and not only what lies on it.
    fn has(&self, log: f32) -> bool {
        self.at(log) >= 2.0 * TABLE_FLOOR
    }
}

/// The density of the object's logarithms: a histogram without the share that is table.
struct ObjectDensity(Vec<f32>);

impl ObjectDensity {
    fn learn(logs: impl Iterator<Item = f32>, table: &TableDensity) -> Self {
        let mut counts = [0.0_f32; BINS];
        logs.for_each(|log| counts[bin(log)] += 1.0);
        let all: f32 = counts.iter().sum();
        let density = |count: f32| count / (all.max(1.0) * BIN);
        let middle = |at: usize| FIRST_BIN + BIN * (at as f32 + 0.5);
        let near_table = (0..BINS).filter(|&at| (middle(at) - table.middle).abs() <= table.spread);
        let included = near_table.map(|at| density(counts[at]) / table.at(middle(at)));
        let included = included.fold(MAX_INCLUDED, f32::min);
        let own: Vec<f32> = (0..BINS)
            .map(|at| (density(counts[at]) - included * table.at(middle(at))).max(0.0))
            .collect();
        let smooth = (0..BINS).map(|at| {
            let beside = own[at.saturating_sub(1)] + own[(at + 1).min(BINS - 1)];
            (0.5 * own[at] + 0.25 * beside) / (1.0 - included) + FLOOR
        });
        Self(smooth.collect())
    }

    fn at(&self, log: f32) -> f32 {
        self.0[bin(log)]
    }
}

fn bin(log: f32) -> usize {
    (((log - FIRST_BIN) / BIN).max(0.0) as usize).min(BINS - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A density around a distance of 1, as the table's.
    fn table() -> TableDensity {
        TableDensity::learn((0..100).map(|at| 0.006 * (at as f32 - 50.0))).unwrap()
    }

    #[test]
    fn openings_in_a_bright_object_are_table_and_the_object_is_not() {
        let bright = (0..1000).map(|at| match at % 10 {
            0 => 0.006 * ((at / 10) as f32 - 50.0),
            _ => 4.0,
        });
        let object = ObjectDensity::learn(bright, &table());
        let ratio = |log: f32| (object.at(log) / table().at(log)).ln();
        assert!(ratio(0.1) < -2.0, "{}", ratio(0.1));
        assert!(ratio(4.0) > 2.0, "{}", ratio(4.0));
    }

    #[test]
    fn shade_makes_the_table_no_brighter_and_an_upright_black_face_is_brighter_in_some_frames() {
        let course = |level: &dyn Fn(usize) -> f32| -> Vec<f32> {
            (0..32).flat_map(|frame| [level(frame); 3]).collect()
        };
        let lit = course(&|_| 0.02);
        let unshaded = Unshaded::learn(&vec![lit.clone(); 9]).unwrap();
        let shaded = course(&|frame| if frame < 20 { 0.002 } else { 0.02 });
        let upright = course(&|frame| if frame < 20 { 0.002 } else { 0.04 });
        assert!(unshaded.brighter(&lit).abs() < 0.01);
        assert!(unshaded.brighter(&shaded).abs() < 0.01);
        assert!(unshaded.brighter(&upright) > 0.5);
    }

    #[test]
    fn a_table_that_gleams_in_the_distance_has_a_trend_that_shade_does_not_bend() {
        let gleam = |at: usize| 0.5 - 0.01 * (at / 10) as f32;
        let shade = |at: usize| {
            if at.is_multiple_of(10) && at > 250 {
                1.0
            } else {
                0.0
            }
        };
        let values: Vec<f32> = (0..500).map(|at| gleam(at) - shade(at)).collect();
        let samples: Vec<usize> = (0..500).collect();
        let trend = Trend::learn(&values, &samples, 10);
        assert!((trend.at(5) - gleam(5)).abs() < 0.03);
        assert!((trend.at(495) - gleam(495)).abs() < 0.03);
    }

    #[test]
    fn of_an_object_as_black_as_the_table_little_is_said() {
        let black = (0..1000).map(|at| 0.001 * at as f32);
        let object = ObjectDensity::learn(black, &table());
        let ratio = |log: f32| (object.at(log) / table().at(log)).ln();
        assert!(ratio(0.3).abs() < 2.0, "{}", ratio(0.3));
    }
}
