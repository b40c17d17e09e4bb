//! The exposure number of every delivered frame, from counter and time stamps or from one of them.

use relit_data::statistics::upper_median;

use super::anomaly::TimingAnomaly;
use super::line::Line;
use super::period_fit::PeriodFit;

/// Largest distance, in periods, of a stamp from where its number is due that confirms the counter.
/// A difference of one exposure between counter and stamps shows as a distance of a half.
const CONFIRMED: f64 = 0.47;
/// Frames on each side that outvote one whose stamp is off by a whole period.
const VOTERS: usize = 3;
/// Fewest stamps from which a period is found.
const MIN_FOR_FIT: usize = 8;

/// Exposure numbers of the delivered frames.
pub(super) struct Numbering {
    /// When exposures are due.
    pub(super) line: Line,
    /// For each frame its exposure; the first is 0, and they grow.
    pub(super) exposures: Vec<u64>,
    /// What does not fit.
    pub(super) anomalies: Vec<TimingAnomaly>,
}

impl Numbering {
    /// With a counter that counts exposures.
    pub(super) fn by_both(counted: &[i64], times: &[f64], nominal: f64) -> Self {
        let line = Line::through(counted, times).unwrap_or(Line {
            start: 0.0,
            period: nominal,
        });
        let grows = counted.windows(2).all(|pair| pair[1] > pair[0]);
        let confirms = |(&number, &time): (&i64, &f64)| line.off(number, time).abs() <= CONFIRMED;
        if grows && counted.iter().zip(times).all(confirms) {
            return Self::by_stamps(line, counted, Vec::new());
        }
        let expected = median_period(counted, times).unwrap_or(nominal);
        let enough = times.len() >= MIN_FOR_FIT;
        match PeriodFit::find(times, expected).filter(|_| enough) {
            Some(fit) => Self::reconciled(counted, times, &fit),
            None => Self::irregular(line, counted),
        }
    }

    /// Without a usable counter.
    pub(super) fn by_time(times: &[f64], nominal: f64) -> Self {
        let fit = if times.len() >= MIN_FOR_FIT {
            PeriodFit::find(times, nominal)
        } else {
            Some(PeriodFit::from_few(times, nominal))
        };
        let Some(PeriodFit { line, mut numbers }) = fit else {
            let numbers: Vec<i64> = (0..times.len() as i64).collect();
            let line = Line::through(&numbers, times).unwrap_or(Line {
                start: 0.0,
                period: nominal,
            });
            return Self::irregular(line, &numbers);
        };
        let mut anomalies = Vec::new();
        for at in 1..numbers.len() {
            if numbers[at] > numbers[at - 1] {
                continue;
            }
            // The one before was late if the exposure before its own is free.
            if at >= 2 && numbers[at] == numbers[at - 1] && numbers[at - 2] < numbers[at - 1] - 1 {
                numbers[at - 1] -= 1;
                anomalies.push(TimingAnomaly::OddTime {
                    frame: at - 1,
                    off: 1,
                });
            } else {
                anomalies.push(TimingAnomaly::SamePeriod { frame: at });
            }
        }
        Self::by_stamps(line, &numbers, anomalies)
    }

    fn by_stamps(line: Line, numbers: &[i64], anomalies: Vec<TimingAnomaly>) -> Self {
        Self {
            line,
            exposures: growing(numbers),
            anomalies,
        }
    }

    fn irregular(line: Line, numbers: &[i64]) -> Self {
        Self::by_stamps(line, numbers, vec![TimingAnomaly::Irregular])
    }

    /// Where counter and stamps differ somewhere: the stamps decide, unless one is off alone.
    fn reconciled(counted: &[i64], times: &[f64], fit: &PeriodFit) -> Self {
        let pairs = fit.numbers.iter().zip(counted);
        let offsets: Vec<i64> = pairs.map(|(timed, counted)| timed - counted).collect();
        let steady: Vec<i64> = (0..offsets.len()).map(|at| vote(&offsets, at)).collect();
        let mut anomalies = Vec::new();
        for at in 0..counted.len() {
            if offsets[at] != steady[at] {
                let off = offsets[at] - steady[at];
                anomalies.push(TimingAnomaly::OddTime { frame: at, off });
            }
            if at > 0 && steady[at] != steady[at - 1] {
                let grown = counted[at] - counted[at - 1];
                anomalies.push(TimingAnomaly::Contradiction {
                    before: at,
                    counted: grown,
                    timed: grown + steady[at] - steady[at - 1],
                });
            }
        }
        let pairs = counted.iter().zip(&steady);
        let numbers: Vec<i64> = pairs.map(|(counted, steady)| counted + steady).collect();
        let line = Line::through(&numbers, times).unwrap_or(fit.line);
        Self::by_stamps(line, &numbers, anomalies)
    }
}

/// The median time of one step of the counter, taken over several steps each: contradictions are
/// few.
fn median_period(counted: &[i64], times: &[f64]) -> Option<f64> {
    let lag = (counted.len() / 4).clamp(1, 64);
    let frames = || counted.iter().zip(times);
    let periods = frames()
        .zip(frames().skip(lag))
        .filter_map(|((n0, t0), (n1, t1))| {
            let period = (t1 - t0) / (n1 - n0) as f64;
            (n1 > n0 && period > 0.0).then_some(period)
        });
    upper_median(periods)
}

/// The difference between stamps and counter around a frame, by majority: its neighbours outvote
/// a frame that stands alone.
fn vote(offsets: &[i64], at: usize) -> i64 {
    let around = &offsets[at.saturating_sub(VOTERS)..(at + VOTERS + 1).min(offsets.len())];
    let votes = |value: i64| around.iter().filter(|&&other| other == value).count();
    let own = offsets[at];
    // Two alike are a step near an end, or the beginning of one; one alone is a stray stamp.
    if votes(own) > 1 || around.len() < 3 {
        return own;
    }
    let most = around.iter().copied().max_by_key(|&value| votes(value));
    most.unwrap_or(own)
}

/// Exposures from the first number on, made to grow where the numbers repeat or go back.
fn growing(numbers: &[i64]) -> Vec<u64> {
    let first = numbers.first().copied().unwrap_or(0);
    let mut least = 0;
    let grown = numbers.iter().map(|&number| {
        let exposure = number.saturating_sub(first).max(0).cast_unsigned();
        let exposure = exposure.max(least);
        least = exposure.saturating_add(1);
        exposure
    });
    grown.collect()
}
