//! From reports to angles: where the table was at any time of the host's clock.
//!
//! In the part of a turn at constant speed the angle is a linear function of time. If the controller
//! stamps its reports, the line is fitted against the chip's clock, without the line's delays, and
//! the chip's clock is fitted against the host's by the requests that were answered fastest. Without
//! stamps, a report counts for the middle between request and arrival.
//!
//! This module knows reports and lines, and nothing of the protocol.

mod line;
#[cfg(test)]
mod tests;

use relit_data::turn_motion::{JournaledReport, JournaledTurn};

use super::protocol::{ControllerState, StatusReport};
use line::{Fit, Line};

/// Minimum number of reports.
const MIN_POLLS: usize = 12;
/// Minimum number of reports of a turn that was interrupted.
const MIN_OF_PART: usize = 3;
/// Over a shorter time, microseconds, the planned speed is nearer to the truth than a measured one.
const SHORT_US: f64 = 2e6;
/// Minimum fraction of the angle at constant speed that the reports cover.
const MIN_COVER: f64 = 0.8;
/// Largest fraction of outliers.
const MAX_OUTLIERS: f64 = 0.25;
/// Largest relative error of the chip's clock and of the speed: ceramic resonators are accurate to
/// half a per cent.
const MAX_OFF: f64 = 0.03;
/// The turn is divided into so many parts, and the fastest answers of each are used.
const PARTS: usize = 10;
/// One in so many answers of a part counts as one of the fastest.
const FASTEST: usize = 4;
/// Smallest residual that can be an outlier in the fit of the clocks, microseconds.
const CLOCK_FLOOR_US: f64 = 200.0;
/// Period after which the chip's time stamps wrap around, microseconds.
const WRAP_US: f64 = 4_294_967_296.0;

fn uneven(outliers: usize, polls: usize) -> String {
    let found = if outliers * 2 > polls {
        format!("the {polls} reports do not lie on a straight line")
    } else {
        format!("{outliers} of {polls} reports lie off the line of the others")
    };
    format!("{found}: the table did not turn evenly, or the serial line is bad")
}

/// The table's angle over time, in the part of a turn at constant speed: a straight line.
#[derive(Debug, Clone, PartialEq)]
pub struct AngleFit {
    line: Line,
    from_us: i64,
    to_us: i64,
    /// Number of reports used.
    pub polls: usize,
    /// Number of reports left out as outliers.
    pub outliers: usize,
    /// Half the shortest round trip, microseconds: an upper bound of the track's time error, however
    /// unequal the delays in the two directions are.
    pub half_round_trip_us: f64,
    /// Seconds of the chip's clock per second of the host's; `None` if reports have no stamps.
    pub chip_rate: Option<f64>,
}

impl AngleFit {
    /// The table's angle at `t_us` microseconds of the host's clock, degrees; `None` outside
    /// the part at constant speed.
    pub fn angle_at(&self, t_us: i64) -> Option<f64> {
        (self.from_us..=self.to_us)
            .contains(&t_us)
            .then(|| self.line.at(t_us as f64))
    }

    /// Start and end of the part at constant speed, microseconds of the host's clock.
    pub fn constant_us(&self) -> (i64, i64) {
        (self.from_us, self.to_us)
    }

    /// Speed by the host's clock, degrees/s; negative for turns in the negative direction.
    pub fn degrees_per_second(&self) -> f64 {
        self.line.slope * 1e6
    }
}

/// A report as the journal keeps it; `None` for one that shows nothing of the part at constant speed.
pub(crate) fn timed(report: &StatusReport, turn: &JournaledTurn) -> Option<JournaledReport> {
    let usable =
        report.certain && report.state == ControllerState::Run && covers(turn, report.machine_deg);
    usable.then_some(JournaledReport {
        asked_us: report.asked_us?,
        came_us: report.came_us,
        chip_us: report.chip_us,
        machine_deg: report.machine_deg,
    })
}

impl AngleFit {
    /// The track of an interrupted turn by what was reported of it; `None` if that does not determine it.
    pub fn from_reports(turn: &JournaledTurn, reports: &[JournaledReport]) -> Option<Self> {
        Self::from_part(reports, turn).ok()
    }

    /// The track of a turn that was interrupted, up to its last report.
    ///
    /// # Errors
    /// Why not, if there are too few reports, or they do not lie on a line of the planned speed.
    fn from_part(reports: &[JournaledReport], expected: &JournaledTurn) -> Result<Self, String> {
        let points = points(reports, expected);
        let (Some(first), Some(last)) = (points.first(), points.last()) else {
            return Err(too_few(&points, MIN_OF_PART));
        };
        if points.len() < MIN_OF_PART {
            return Err(too_few(&points, MIN_OF_PART));
        }
        let until_us = last.asked_us;
        let is_short = last.asked_us - first.asked_us < SHORT_US || points.len() < MIN_POLLS;
        let fitted = if is_short {
            by_the_plan(&points, expected)
        } else {
            by_the_reports(&points, expected)?
        };
        let mut track = checked_track(&points, expected, &fitted)?;
        // What came after the last report is not known: the table may have been stopped.
        track.to_us = track.to_us.min(until_us as i64);
        Ok(track)
    }
}

/// The direction of a turn: 1 or -1.
fn sign(turn: &JournaledTurn) -> f64 {
    (turn.to_deg - turn.from_deg).signum()
}

/// Whether a position is in the part at constant speed, at least a step away from its ends.
fn covers(turn: &JournaledTurn, machine_deg: f64) -> bool {
    let gone = (machine_deg - turn.from_deg) * sign(turn);
    let length = (turn.to_deg - turn.from_deg).abs();
    (turn.step_deg..=length - turn.step_deg).contains(&gone)
}

/// A report as a point of the fit: the times of request and arrival, and the angle in the middle of
/// the step.
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

/// Fits the track of a turn to its reports.
pub(crate) fn fit(reports: &[StatusReport], expected: &JournaledTurn) -> Result<AngleFit, String> {
    let timed = |report: &StatusReport| self::timed(report, expected);
    let reports: Vec<_> = reports.iter().filter_map(timed).collect();
    let points = points(&reports, expected);
    enough(&points, expected)?;
    let fitted = by_the_reports(&points, expected)?;
    checked_track(&points, expected, &fitted)
}

fn by_the_reports(points: &[Point], expected: &JournaledTurn) -> Result<Fitted, String> {
    if points.iter().all(|point| point.chip_us.is_some()) {
        by_the_chip(points, expected)
    } else {
        Ok(by_the_middle(points, expected))
    }
}

fn checked_track(
    points: &[Point],
    expected: &JournaledTurn,
    fitted: &Fitted,
) -> Result<AngleFit, String> {
    if fitted.outliers as f64 > points.len() as f64 * MAX_OUTLIERS {
        return Err(uneven(fitted.outliers, points.len()));
    }
    let measured = fitted.line.slope * 1e6;
    let planned = expected.degrees_per_second * sign(expected);
    if (measured / planned - 1.0).abs() > MAX_OFF {
        return Err(format!(
            "the table turned at {measured:.4} degrees/s instead of {planned:.4}: check $100, $110 and the microsteps"
        ));
    }
    Ok(track(points, expected, fitted))
}

/// The line of angles over the host's time.
struct Fitted {
    line: Line,
    outliers: usize,
    chip_rate: Option<f64>,
}

fn points(reports: &[JournaledReport], expected: &JournaledTurn) -> Vec<Point> {
    let half_step = sign(expected) * expected.step_deg / 2.0;
    let point = |report: &JournaledReport| Point {
        asked_us: report.asked_us as f64,
        came_us: report.came_us as f64,
        chip_us: report.chip_us,
        angle_deg: report.machine_deg + half_step - expected.zero_deg,
    };
    reports.iter().map(point).collect()
}

fn too_few(points: &[Point], needed: usize) -> String {
    format!(
        "only {} reports fall into the part at constant speed, and {needed} are needed: check the serial line",
        points.len()
    )
}

fn enough(points: &[Point], expected: &JournaledTurn) -> Result<(), String> {
    if points.len() < MIN_POLLS {
        return Err(too_few(points, MIN_POLLS));
    }
    let angles = || points.iter().map(|point| point.angle_deg);
    let covered = angles().fold(f64::MIN, f64::max) - angles().fold(f64::MAX, f64::min);
    let cover = covered / (expected.to_deg - expected.from_deg).abs();
    if cover < MIN_COVER {
        return Err(format!(
            "the reports cover {:.0} % of the part at constant speed: check the serial line",
            cover * 100.0
        ));
    }
    Ok(())
}

fn by_the_middle(points: &[Point], expected: &JournaledTurn) -> Fitted {
    let pair = |point: &Point| (point.middle_us(), point.angle_deg);
    let pairs: Vec<_> = fastest(points).iter().map(pair).collect();
    let Fit { line, .. } = line::robust(&pairs, expected.step_deg);
    on_line(points, expected, line)
}

/// The line of the planned speed through the fastest answers.
fn by_the_plan(points: &[Point], expected: &JournaledTurn) -> Fitted {
    let slope = expected.degrees_per_second * sign(expected) / 1e6;
    let pair = |point: &Point| (point.middle_us(), point.angle_deg);
    let pairs: Vec<_> = fastest(points).iter().map(pair).collect();
    on_line(points, expected, line::through(&pairs, slope))
}

fn on_line(points: &[Point], expected: &JournaledTurn, line: Line) -> Fitted {
    // A slow answer lies off the line by its delay; it does not show that the table turned unevenly.
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

fn by_the_chip(points: &[Point], expected: &JournaledTurn) -> Result<Fitted, String> {
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
    if !(1.0 - MAX_OFF..=1.0 + MAX_OFF).contains(&factor) {
        return Err(format!(
            "the controller's clock runs {factor:.4} times as fast as the host's: its firmware is made for another crystal"
        ));
    }
    Ok(Fitted {
        line: by_chip.line.over(&clocks.line),
        outliers: by_chip.kept.iter().filter(|kept| !**kept).count(),
        chip_rate: Some(factor),
    })
}

/// The chip's time of each point since the first one, microseconds. Stamps wrap around every 71
/// minutes; the host's clock shows how many times they did.
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

/// The fastest answers of each part of the turn, in order.
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

fn track(points: &[Point], expected: &JournaledTurn, fitted: &Fitted) -> AngleFit {
    let line = fitted.line;
    let time = |machine_deg: f64| {
        let t_us = line.inverse(machine_deg - expected.zero_deg);
        t_us.unwrap_or_default()
    };
    let quick = fastest(points);
    let trips = quick.iter().map(Point::round_trip_us);
    AngleFit {
        line,
        from_us: time(expected.from_deg).ceil() as i64,
        to_us: time(expected.to_deg).floor() as i64,
        polls: points.len() - fitted.outliers,
        outliers: fitted.outliers,
        half_round_trip_us: trips.fold(f64::MAX, f64::min) / 2.0,
        chip_rate: fitted.chip_rate,
    }
}
