//! From reports to angles: where the table was at any time of the host's clock.
//!
//! Over the part of a turn at constant speed the angle is a straight line over time. A controller
//! that stamps its reports gives that line against its own clock, free of the wire's delays, and
//! the chip's clock is laid against the host's by the questions that were answered fastest. A
//! controller that does not stamp them leaves the middle between question and report.
//!
//! This room knows reports and lines, and nothing of the wire.

mod line;
#[cfg(test)]
mod tests;

use super::supervisor::PositionReport;
use super::wire::ControllerState;
use line::{Fit, Line};

/// Least reports a track is made of.
const LEAST_POLLS: usize = 12;
/// Least part of the constant-speed angle that they cover.
const LEAST_COVER: f64 = 0.8;
/// Largest part of them that may be outliers.
const MOST_OUTLIERS: f64 = 0.25;
/// How far chip and speed may be off: ceramic resonators are good to half a per cent.
const MOST_OFF: f64 = 0.03;
/// The time is cut into so many parts, and the fastest answers of each are taken.
const PARTS: usize = 10;
/// The fastest answers of a part: one in so many.
const FASTEST: usize = 4;
/// Residuals below this are never outliers, of the host's clock, microseconds.
const CLOCK_FLOOR_US: f64 = 200.0;
/// Microseconds after which a chip's clock starts again.
const WRAP_US: f64 = 4_294_967_296.0;

/// Why reports give no angles.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TrackError {
    /// Too few reports.
    #[error(
        "only {polls} reports fall into the part at constant speed, and {LEAST_POLLS} are needed: check the serial line"
    )]
    TooFew {
        /// How many.
        polls: usize,
    },
    /// They leave gaps.
    #[error(
        "the reports cover {percent:.0} % of the part at constant speed: check the serial line"
    )]
    Gaps {
        /// Per cent.
        percent: f64,
    },
    /// They do not lie on a line.
    #[error(
        "{outliers} of {polls} reports lie off the line of the others: the table did not turn evenly, or the serial line is bad"
    )]
    Uneven {
        /// Off the line.
        outliers: usize,
        /// All.
        polls: usize,
    },
    /// The chip's clock is off.
    #[error(
        "the controller's clock runs {factor:.4} times as fast as the host's: its firmware is made for another crystal"
    )]
    Clock {
        /// Chip seconds in a second of the host.
        factor: f64,
    },
    /// The speed is off.
    #[error(
        "the table turned at {measured:.4} degrees/s instead of {planned:.4}: check $100, $110 and the microsteps"
    )]
    Speed {
        /// By the reports.
        measured: f64,
        /// By the plan.
        planned: f64,
    },
}

/// How far reports lie off the track, degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residuals {
    /// Half of them are below this.
    pub median_deg: f64,
    /// 99 of 100 are below this.
    pub p99_deg: f64,
    /// The largest.
    pub max_deg: f64,
}

/// Where the table was: a straight line over the part of a turn at constant speed.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    line: Line,
    from_us: i64,
    to_us: i64,
    residuals: Residuals,
    polls: usize,
    outliers: usize,
    half_round_trip_us: f64,
    chip_rate: Option<f64>,
}

impl Track {
    /// The table's angle at `t_us` microseconds of the host's clock, degrees; `None` outside of
    /// the part at constant speed.
    #[must_use]
    pub fn angle_at(&self, t_us: i64) -> Option<f64> {
        (self.from_us..=self.to_us)
            .contains(&t_us)
            .then(|| self.line.at(t_us as f64))
    }

    /// When the table was at `angle_deg`, microseconds of the host's clock; `None` outside of the
    /// part at constant speed.
    #[must_use]
    pub fn time_at(&self, angle_deg: f64) -> Option<i64> {
        let t_us = self.line.inverse(angle_deg)?.round() as i64;
        (self.from_us..=self.to_us).contains(&t_us).then_some(t_us)
    }

    /// Start and end of the part at constant speed, microseconds of the host's clock.
    #[must_use]
    pub fn constant_us(&self) -> (i64, i64) {
        (self.from_us, self.to_us)
    }

    /// Speed by the host's clock, degrees a second; negative for turns the other way.
    #[must_use]
    pub fn degrees_per_second(&self) -> f64 {
        self.line.slope * 1e6
    }

    /// How far the reports that were answered fastest lie off the track.
    #[must_use]
    pub fn residuals(&self) -> Residuals {
        self.residuals
    }

    /// Reports that the track is made of.
    #[must_use]
    pub fn polls(&self) -> usize {
        self.polls
    }

    /// Reports that were left out because they lie off the line of the others.
    #[must_use]
    pub fn outliers(&self) -> usize {
        self.outliers
    }

    /// Half the time of the fastest answers, microseconds: the track's times cannot be wrong by
    /// more, however unequal the delays there and back are.
    #[must_use]
    pub fn half_round_trip_us(&self) -> f64 {
        self.half_round_trip_us
    }

    /// Seconds of the chip's clock in a second of the host's; `None` where reports have no stamp.
    #[must_use]
    pub fn chip_rate(&self) -> Option<f64> {
        self.chip_rate
    }
}

/// What the turn was to be, degrees from machine zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ExpectedTurn {
    /// Where the part at constant speed starts.
    pub(crate) from_deg: f64,
    /// Where it ends.
    pub(crate) to_deg: f64,
    /// Speed without sign.
    pub(crate) degrees_per_second: f64,
    /// The angle counted as zero.
    pub(crate) zero_deg: f64,
    /// One step.
    pub(crate) step_deg: f64,
}

impl ExpectedTurn {
    fn sign(&self) -> f64 {
        (self.to_deg - self.from_deg).signum()
    }

    /// Whether a place is inside of the part at constant speed, a step away from its ends.
    fn covers(&self, machine_deg: f64) -> bool {
        let gone = (machine_deg - self.from_deg) * self.sign();
        let length = (self.to_deg - self.from_deg).abs();
        (self.step_deg..=length - self.step_deg).contains(&gone)
    }
}

/// A report as a point: the bracket in time around it, and the angle in the middle of the step
/// that the table was on.
#[derive(Debug, Clone, Copy)]
struct Point {
    asked_us: f64,
    came_us: f64,
    chip_us: Option<u32>,
    angle_deg: f64,
}

impl Point {
    fn round_trip_us(&self) -> f64 {
        self.came_us - self.asked_us
    }

    fn middle_us(&self) -> f64 {
        f64::midpoint(self.asked_us, self.came_us)
    }
}

/// The track of a turn by its reports.
pub(crate) fn fit(
    reports: &[PositionReport],
    expected: &ExpectedTurn,
) -> Result<Track, TrackError> {
    let points = points(reports, expected);
    enough(&points, expected)?;
    let stamped = points.iter().all(|point| point.chip_us.is_some());
    let fitted = if stamped {
        by_the_chip(&points, expected)?
    } else {
        by_the_middle(&points, expected)
    };
    if fitted.outliers as f64 > points.len() as f64 * MOST_OUTLIERS {
        return Err(TrackError::Uneven {
            outliers: fitted.outliers,
            polls: points.len(),
        });
    }
    let measured = fitted.line.slope * 1e6;
    let planned = expected.degrees_per_second * expected.sign();
    if (measured / planned - 1.0).abs() > MOST_OFF {
        return Err(TrackError::Speed { measured, planned });
    }
    Ok(track(&points, expected, &fitted))
}

/// The line of angles over the host's time, and what it is made of.
struct Fitted {
    line: Line,
    outliers: usize,
    chip_rate: Option<f64>,
}

fn points(reports: &[PositionReport], expected: &ExpectedTurn) -> Vec<Point> {
    let half_step = expected.sign() * expected.step_deg / 2.0;
    let point = |report: &PositionReport| {
        let usable = report.certain
            && report.state == ControllerState::Run
            && expected.covers(report.machine_deg);
        usable.then_some(Point {
            asked_us: report.asked_us? as f64,
            came_us: report.came_us as f64,
            chip_us: report.chip_us,
            angle_deg: report.machine_deg + half_step - expected.zero_deg,
        })
    };
    reports.iter().filter_map(point).collect()
}

fn enough(points: &[Point], expected: &ExpectedTurn) -> Result<(), TrackError> {
    if points.len() < LEAST_POLLS {
        return Err(TrackError::TooFew {
            polls: points.len(),
        });
    }
    let angles = || points.iter().map(|point| point.angle_deg);
    let covered = angles().fold(f64::MIN, f64::max) - angles().fold(f64::MAX, f64::min);
    let cover = covered / (expected.to_deg - expected.from_deg).abs();
    if cover < LEAST_COVER {
        return Err(TrackError::Gaps {
            percent: cover * 100.0,
        });
    }
    Ok(())
}

fn by_the_middle(points: &[Point], expected: &ExpectedTurn) -> Fitted {
    let pair = |point: &Point| (point.middle_us(), point.angle_deg);
    let pairs: Vec<_> = fastest(points).iter().map(pair).collect();
    let Fit { line, .. } = line::robust(&pairs, expected.step_deg);
    // A slow answer lies off the line by its delay, and is none of an uneven table's.
    let allowed =
        |point: &Point| expected.step_deg * 2.0 + point.round_trip_us() / 2.0 * line.slope.abs();
    let off =
        |point: &&Point| (point.angle_deg - line.at(point.middle_us())).abs() > allowed(point);
    Fitted {
        line,
        outliers: points.iter().filter(off).count(),
        chip_rate: None,
    }
}

fn by_the_chip(points: &[Point], expected: &ExpectedTurn) -> Result<Fitted, TrackError> {
    let stamps = unwrapped(points);
    let angles: Vec<_> = stamps
        .iter()
        .zip(points)
        .map(|(&chip, p)| (chip, p.angle_deg))
        .collect();
    let by_chip = line::robust(&angles, expected.step_deg * 2.0);

    let stamped = points
        .iter()
        .zip(&stamps)
        .map(|(&point, &chip)| (point, chip));
    let kept: Vec<_> = stamped
        .zip(&by_chip.kept)
        .filter(|(_, kept)| **kept)
        .map(|(p, _)| p)
        .collect();
    let quick = fastest_by(&kept, |(point, _)| point);
    let host: Vec<_> = quick
        .iter()
        .map(|(point, chip)| (*chip, point.middle_us()))
        .collect();
    let clocks = line::robust(&host, CLOCK_FLOOR_US);
    let factor = clocks.line.slope.recip();
    if !(1.0 - MOST_OFF..=1.0 + MOST_OFF).contains(&factor) {
        return Err(TrackError::Clock { factor });
    }
    Ok(Fitted {
        line: by_chip.line.over(&clocks.line),
        outliers: by_chip.kept.iter().filter(|kept| !**kept).count(),
        chip_rate: Some(factor),
    })
}

/// The chip's time of each point since the first one, microseconds. A stamp starts again every 71
/// minutes; the host's clock tells how often it has.
fn unwrapped(points: &[Point]) -> Vec<f64> {
    let Some(first) = points.first() else {
        return Vec::new();
    };
    let since = |point: &Point| {
        let stamp = point.chip_us.unwrap_or_default();
        let within = f64::from(stamp.wrapping_sub(first.chip_us.unwrap_or_default()));
        let gone = point.middle_us() - first.middle_us();
        within + ((gone - within) / WRAP_US).round() * WRAP_US
    };
    points.iter().map(since).collect()
}

fn fastest(points: &[Point]) -> Vec<Point> {
    fastest_by(points, |point| point)
}

/// The fastest answers of each part of the time, in order.
fn fastest_by<T: Copy>(items: &[T], point: impl Fn(&T) -> &Point) -> Vec<T> {
    let size = items.len().div_ceil(PARTS).max(1);
    let mut chosen = Vec::new();
    for part in items.chunks(size) {
        let mut part = part.to_vec();
        let trip = |item: &T| point(item).round_trip_us();
        part.sort_by(|a, b| trip(a).total_cmp(&trip(b)));
        part.truncate(part.len().div_ceil(FASTEST));
        chosen.extend(part);
    }
    chosen
}

fn track(points: &[Point], expected: &ExpectedTurn, fitted: &Fitted) -> Track {
    let line = fitted.line;
    let time = |machine_deg: f64| {
        let t_us = line.inverse(machine_deg - expected.zero_deg);
        t_us.unwrap_or_default()
    };
    let quick = fastest(points);
    let off = |point: &Point| (point.angle_deg - line.at(point.middle_us())).abs();
    let mut offs: Vec<f64> = quick.iter().map(off).collect();
    offs.sort_by(f64::total_cmp);
    let trips = quick.iter().map(Point::round_trip_us);
    Track {
        line,
        from_us: time(expected.from_deg).ceil() as i64,
        to_us: time(expected.to_deg).floor() as i64,
        residuals: Residuals {
            median_deg: line::quantile(&offs, 0.5),
            p99_deg: line::quantile(&offs, 0.99),
            max_deg: offs.last().copied().unwrap_or_default(),
        },
        polls: points.len() - fitted.outliers,
        outliers: fitted.outliers,
        half_round_trip_us: trips.fold(f64::MAX, f64::min) / 2.0,
        chip_rate: fitted.chip_rate,
    }
}
