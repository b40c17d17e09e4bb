//! What the two witnesses say, apart and together.

use super::comb::Comb;
use super::{Doubt, Found, Line, from_first, strictly};

/// Largest distance of a stamp from its place that confirms the counter, periods. A step of one
/// period between the witnesses shows as a distance of a half.
const CONFIRMED: f64 = 0.47;
/// Frames on each side that outvote one whose stamp is late or early by a whole period.
const VOTERS: usize = 3;
/// As many stamps as it takes to find the period from them alone.
const FEWEST_FOR_COMB: usize = 8;

/// With a counter that counts.
pub(super) fn by_both(counted: &[i64], times: &[f64], nominal: f64) -> Found {
    let fallback = Line {
        start: 0.0,
        period: nominal,
    };
    let line = Line::through(counted, times).unwrap_or(fallback);
    let grows = counted.windows(2).all(|pair| pair[1] > pair[0]);
    let confirms = |(&number, &time): (&i64, &f64)| line.off(number, time).abs() <= CONFIRMED;
    if grows && counted.iter().zip(times).all(confirms) {
        return Found {
            line,
            exposures: from_first(counted),
            agreed: Vec::new(),
            by_time: true,
            doubts: Vec::new(),
        };
    }
    let about = steady_period(counted, times).unwrap_or(nominal);
    let comb = (times.len() >= FEWEST_FOR_COMB)
        .then(|| Comb::find(times, about))
        .flatten();
    match comb {
        Some(comb) => reconcile(counted, times, &comb),
        None => Found {
            line,
            exposures: strictly(counted),
            agreed: Vec::new(),
            by_time: false,
            doubts: vec![Doubt::Irregular],
        },
    }
}

/// The median of what one step of the counter takes, over some steps: contradictions are few.
fn steady_period(counted: &[i64], times: &[f64]) -> Option<f64> {
    let lag = (counted.len() / 4).clamp(1, 64);
    let ahead = counted.iter().zip(times).skip(lag);
    let mut periods: Vec<f64> = counted
        .iter()
        .zip(times)
        .zip(ahead)
        .filter_map(|((n0, t0), (n1, t1))| {
            let period = (t1 - t0) / (n1 - n0) as f64;
            (n1 > n0 && period > 0.0).then_some(period)
        })
        .collect();
    periods.sort_by(f64::total_cmp);
    periods.get(periods.len() / 2).copied()
}

/// Brings together what counter and stamps say, where they part somewhere.
fn reconcile(counted: &[i64], times: &[f64], comb: &Comb) -> Found {
    let offsets: Vec<i64> = comb
        .numbers
        .iter()
        .zip(counted)
        .map(|(timed, counted)| timed - counted)
        .collect();
    let steady: Vec<i64> = (0..offsets.len()).map(|at| vote(&offsets, at)).collect();
    let mut doubts = Vec::new();
    let mut agreed = vec![true; counted.len()];
    let mut numbers = Vec::with_capacity(counted.len());
    for at in 0..counted.len() {
        numbers.push(counted[at] + steady[at]);
        if offsets[at] != steady[at] {
            let off = offsets[at] - steady[at];
            doubts.push(Doubt::OddTime { frame: at, off });
        }
        if at > 0 && steady[at] != steady[at - 1] {
            agreed[at] = false;
            let grown = counted[at] - counted[at - 1];
            doubts.push(Doubt::Contradiction {
                before: at,
                counted: grown,
                timed: grown + steady[at] - steady[at - 1],
            });
        }
    }
    Found {
        line: Line::through(&numbers, times).unwrap_or(comb.line),
        exposures: strictly(&numbers),
        agreed,
        by_time: true,
        doubts,
    }
}

/// What most frames around one say of the difference between both witnesses: a frame alone is
/// outvoted by its neighbours.
fn vote(offsets: &[i64], at: usize) -> i64 {
    let around = &offsets[at.saturating_sub(VOTERS)..(at + VOTERS + 1).min(offsets.len())];
    let votes = |value: i64| around.iter().filter(|&&other| other == value).count();
    let own = offsets[at];
    // Two alike are a step near an end, or the begin of one; one alone is a stamp gone astray.
    if votes(own) > 1 || around.len() < 3 {
        return own;
    }
    around
        .iter()
        .copied()
        .max_by_key(|&value| votes(value))
        .unwrap_or(own)
}

/// Without a counter.
pub(super) fn by_time(times: &[f64], nominal: f64) -> Found {
    let comb = if times.len() >= FEWEST_FOR_COMB {
        Comb::find(times, nominal)
    } else {
        Some(Comb::of_few(times, nominal))
    };
    let Some(comb) = comb else {
        let numbers: Vec<i64> = (0..times.len() as i64).collect();
        let line = Line::through(&numbers, times);
        return Found {
            line: line.unwrap_or(Line {
                start: 0.0,
                period: nominal,
            }),
            exposures: from_first(&numbers),
            agreed: Vec::new(),
            by_time: false,
            doubts: vec![Doubt::Irregular],
        };
    };
    let mut numbers = comb.numbers;
    let mut doubts = Vec::new();
    for at in 1..numbers.len() {
        if numbers[at] > numbers[at - 1] {
            continue;
        }
        // The one before came late, where it left a place free behind itself.
        if at >= 2 && numbers[at] == numbers[at - 1] && numbers[at - 2] < numbers[at - 1] - 1 {
            numbers[at - 1] -= 1;
            doubts.push(Doubt::OddTime {
                frame: at - 1,
                off: 1,
            });
        } else {
            doubts.push(Doubt::SamePeriod { frame: at });
        }
    }
    Found {
        line: comb.line,
        exposures: strictly(&numbers),
        agreed: Vec::new(),
        by_time: true,
        doubts,
    }
}
