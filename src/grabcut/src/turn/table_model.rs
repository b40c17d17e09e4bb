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
/// Which part of what surely is table is at most as bright, and of what was learned from.
const BRIGHTEST: f64 = 0.95;
const BRIGHTEST_LEARNED: f64 = 0.99;
/// Without a plain surface, what lies below the object and is darker than this share of the scene's white is table.
const DARK: f32 = 0.25;
/// The scene's white is what this share of it is at most as bright as.
const WHITE: f64 = 0.9;
/// Share of the height by which what surely is below the object begins above its foot.
const FOOT: f64 = 0.04;
/// Share of the width that keeps the table's pixels away from the object.
const AWAY: f64 = 0.006;
/// A pixel that is brighter than the table's brightest by a share of it is at least so many times that far.
const BRIGHT_IS_FAR: f32 = 6.0;

/// The logarithm of the distance is counted in bins of this width, from here on.
const BIN: f32 = 0.25;
const FIRST_BIN: f32 = -2.0;
const BINS: usize = 36;
/// The spread of the table's logarithm of the distance, at least.
const MIN_SPREAD: f32 = 0.2;
/// Openings are in shade, and further from the table than it is on average: the spread is so many times as wide there.
const SHADED: f32 = 2.0;
/// At most this share of what looks like the object is table.
const MAX_INCLUDED: f32 = 0.2;
/// The object has each distance with at least this density, and so has the table, which an object lights from nearby.
const FLOOR: f32 = 0.01;
const TABLE_FLOOR: f32 = 0.03;
/// The most that the table's model says for the table, in units of the log-likelihood of a pixel.
const STRENGTH: f32 = 8.0;
/// And for the object, where nothing but it can hide the table.
const ON_DISC: f32 = 3.0;
/// Which begins so far below the rim, as a share of the image's width.
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
    /// The pixels that show the table or the object, and never the room.
    pub(crate) on_disc: Bitmap,
    size: (usize, usize),
}

impl TableModel {
    /// Learns the table's space; `None` if no table is seen.
    pub(crate) fn learn(series: &PixelSeries, seen: &TurnObservations<'_>) -> Option<Self> {
        let Candidates { far, surely, table } = candidates(seen, series.size())?;
        let taken = learned_from(series, &surely, &table);
        let samples: Vec<Vec<f32>> = taken.iter().map(|&at| series.smooth(at)).collect();
        let space = Subspace::learn(&samples, DIRECTIONS);
        let brightest = quantile(taken.iter().map(|&at| seen.light[at]), BRIGHTEST_LEARNED)?;
        let distance = distances(series, &space);
        let of_table = quantile(taken.iter().map(|&at| distance[at]), 0.5)?;
        let logs = distance.iter().zip(seen.light).map(|(distance, light)| {
            let brighter = BRIGHT_IS_FAR * (light / brightest.max(1e-6) - 1.0);
            (distance / of_table.max(1e-9)).max(brighter).max(1e-3).ln()
        });
        let logs: Vec<f32> = logs.collect();
        let of_table = TableDensity::learn(taken.iter().map(|&at| logs[at]))?;
        let core = seen.object.eroded(2);
        let core = core.bits().iter().zip(&logs);
        let object = ObjectDensity::learn(
            core.filter(|(bit, _)| **bit).map(|(_, &log)| log),
            &of_table,
        );
        // What is not table on the disc is object; elsewhere it may be the room.
        let (width, _) = series.size();
        let disc = Disc::fit(&table, &far, series.size());
        let bottom = table.bounds().bottom();
        let on_disc = table.map(|at, _| {
            let (x, y) = (at % width, at / width);
            let is_inside = |disc: Disc| disc.contains(x, y, RIM * width as f64);
            (y as i64) < bottom && disc.is_some_and(is_inside)
        });
        let ratio = logs.iter().zip(on_disc.bits()).map(|(&log, &on_disc)| {
            let ratio = (object.at(log) / of_table.at(log)).ln();
            ratio.clamp(-STRENGTH, if on_disc { ON_DISC } else { 0.0 })
        });
        Some(Self {
            ratio: ratio.collect(),
            on_disc,
            size: series.size(),
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
        let mean = |at: usize| four(at).iter().map(|&at| self.ratio[at]).sum::<f32>() / 4.0;
        let on_disc = (0..pixels).map(|at| four(at).iter().all(|&at| self.on_disc.bits()[at]));
        Self {
            ratio: (0..pixels).map(mean).collect(),
            on_disc: Bitmap::new((half.0 as u32, half.1 as u32), on_disc),
            size: half,
        }
    }

    /// The pixels that are more likely table than object by a logarithm of at least this.
    pub(crate) fn alike(&self, least: f32) -> Bitmap {
        let size = (self.size.0 as u32, self.size.1 as u32);
        Bitmap::new(size, self.ratio.iter().map(|&ratio| ratio < -least))
    }
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
    let far = seen.object.dilated(away).inverted();
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

/// How far the smooth course of each pixel is from the space.
fn distances(series: &PixelSeries, space: &Subspace) -> Vec<f32> {
    let length = series.length().max(1) as f32;
    series.map_smooth(|course| (space.residual(course) / length).sqrt())
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
    fn of_an_object_as_black_as_the_table_little_is_said() {
        let black = (0..1000).map(|at| 0.001 * at as f32);
        let object = ObjectDensity::learn(black, &table());
        let ratio = |log: f32| (object.at(log) / table().at(log)).ln();
        assert!(ratio(0.3).abs() < 2.0, "{}", ratio(0.3));
    }
}
