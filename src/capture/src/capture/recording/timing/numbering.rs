//! The exposure number of every delivered frame, from counter and time stamps or from one of them.

use super::anomaly::TimingAnomaly;
use super::line::Line;
use super::period_fit::PeriodFit;

/// Largest distance, in periods, of a stamp from where its number is due that confirms the counter.
/// A difference of one exposure between counter and stamps shows as a distance of a half.
const CONFIRMED: f64 = 0.47;
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
        let mut found = Self::by_time(times, nominal);
        if found.anomalies.contains(&TimingAnomaly::Irregular) {
            return Self::by_stamps(line, counted, found.anomalies);
        }
        let timed = found.exposures.windows(2);
        let timed = timed.map(|pair| (pair[1] - pair[0]).cast_signed());
        let steps = (1..).zip(counted.windows(2).map(|pair| pair[1] - pair[0]).zip(timed));
        let differ = steps.filter(|(_, (counted, timed))| counted != timed);
        found.anomalies = differ
            .map(|(before, (counted, timed))| TimingAnomaly::Contradiction {
                before,
                counted,
                timed,
            })
            .collect();
        found
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
            return Self::by_stamps(line, &numbers, vec![TimingAnomaly::Irregular]);
        };
        for at in 2..numbers.len() {
            // The one before was late if the exposure before its own is free.
            if numbers[at] == numbers[at - 1] && numbers[at - 2] < numbers[at - 1] - 1 {
                numbers[at - 1] -= 1;
            }
        }
        Self::by_stamps(line, &numbers, Vec::new())
    }

    fn by_stamps(line: Line, numbers: &[i64], anomalies: Vec<TimingAnomaly>) -> Self {
        Self {
            line,
            exposures: growing(numbers),
            anomalies,
        }
    }
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
