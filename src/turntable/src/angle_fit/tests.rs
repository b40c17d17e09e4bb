#![allow(clippy::unwrap_used, reason = "a test's own mistakes should be loud")]

use std::collections::HashSet;

use proptest::prelude::*;

use crate::angle_fit::*;
use crate::protocol::Pins;

const STEP: f64 = 1.0 / 88.889;
const EXPECTED: JournaledTurn = JournaledTurn {
    from_deg: -2.0,
    to_deg: 362.0,
    degrees_per_second: 7.2,
    zero_deg: 0.0,
    step_deg: STEP,
};
const START_US: i64 = 5_000_000_000;

/// A simple generator of random numbers in 0..1 (Lehmer; Park and Miller 1988).
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 = self.0 * 48_271 % 2_147_483_647;
        self.0 as f64 / 2_147_483_647.0
    }
}

/// A turn as its table would report it.
struct Turn {
    /// Interval of requests.
    every_us: i64,
    /// Delays in both directions: the minimum, and the mean of what is added.
    there_us: (f64, f64),
    back_us: (f64, f64),
    /// Chip seconds per second.
    rate: f64,
    stamps: bool,
    /// The chip's stamp at the start.
    stamp: u32,
    /// Fraction of the reports with a wrong position.
    wrong: f64,
}

const USUAL: Turn = Turn {
    every_us: 66_667,
    there_us: (400.0, 600.0),
    back_us: (900.0, 1200.0),
    rate: 1.003,
    stamps: true,
    stamp: 1000,
    wrong: 0.0,
};

impl Turn {
    /// The true angle.
    fn angle(&self, t_us: f64) -> f64 {
        -3.0 + 7.2 * self.rate * (t_us - START_US as f64) * 1e-6
    }

    fn reports(&self, seed: u64) -> Vec<StatusReport> {
        let mut chance = Chance(seed % 2_000_000_000 + 1);
        let asked = (0..).map(|n| START_US + n * self.every_us);
        let asked = asked.take_while(|us| self.angle(*us as f64) < 363.0);
        asked
            .map(|asked_us| self.report(asked_us, &mut chance))
            .collect()
    }

    fn report(&self, asked_us: i64, chance: &mut Chance) -> StatusReport {
        let delay =
            |(least, added): (f64, f64), chance: &mut Chance| least - added * chance.next().ln();
        let latched = asked_us as f64 + delay(self.there_us, chance);
        let steps = (self.angle(latched) / STEP).floor();
        let off = if chance.next() < self.wrong {
            chance.next() * 5.0
        } else {
            0.0
        };
        let chip = ((latched - START_US as f64) * self.rate) as u64;
        StatusReport {
            alarm: None,
            homed: None,
            state: ControllerState::Run,
            machine_deg: ((steps * STEP + off) * 1000.0).round() / 1000.0,
            feed: Some(432.0),
            chip_us: self.stamps.then_some(self.stamp.wrapping_add(chip as u32)),
            battery_v: None,
            pins: Pins::default(),
            asked_us: Some(asked_us),
            came_us: (latched + delay(self.back_us, chance)) as i64,
            certain: true,
        }
    }

    /// The largest error of the track, degrees.
    fn error(&self, seed: u64) -> f64 {
        let track = fit(&self.reports(seed), &EXPECTED).unwrap();
        let (from_us, to_us) = track.constant_us();
        let error = |t_us: i64| (track.angle_at(t_us).unwrap() - self.angle(t_us as f64)).abs();
        (from_us..=to_us)
            .step_by(33_333)
            .map(error)
            .fold(0.0, f64::max)
    }
}

#[test]
fn stamped_reports_give_the_angle_to_a_hundredth_of_a_degree() {
    for seed in 0..20 {
        assert!(USUAL.error(seed) < 0.01, "{}", USUAL.error(seed));
    }
}

#[test]
fn reports_without_stamp_give_it_to_two_hundredths() {
    let stock = Turn {
        every_us: 200_000,
        stamps: false,
        ..USUAL
    };
    for seed in 0..20 {
        assert!(stock.error(seed) < 0.02, "{}", stock.error(seed));
    }
}

#[test]
fn slow_and_unequal_delays_do_not_matter_as_long_as_some_answers_are_fast() {
    let slow = Turn {
        back_us: (900.0, 20_000.0),
        there_us: (400.0, 300.0),
        ..USUAL
    };
    for seed in 0..20 {
        assert!(slow.error(seed) < 0.02, "{}", slow.error(seed));
    }
}

#[test]
fn wrong_reports_are_left_out_and_counted() {
    for stamps in [true, false] {
        let turn = Turn {
            wrong: 0.1,
            stamps,
            ..USUAL
        };
        assert!(turn.error(7) < 0.02, "{}", turn.error(7));
        let track = fit(&turn.reports(7), &EXPECTED).unwrap();
        assert!((40..120).contains(&track.outliers), "{}", track.outliers);
    }
}

#[test]
fn a_chips_clock_that_wraps_around_in_the_middle_is_followed() {
    let wrapping = Turn {
        stamp: u32::MAX - 20_000_000,
        ..USUAL
    };
    assert!(wrapping.error(3) < 0.01, "{}", wrapping.error(3));
}

#[test]
fn angles_are_known_inside_the_constant_part_only() {
    let track = fit(&USUAL.reports(1), &EXPECTED).unwrap();
    let (from_us, to_us) = track.constant_us();
    assert!(track.angle_at(from_us).is_some() && track.angle_at(to_us).is_some());
    assert_eq!(
        (track.angle_at(from_us - 1), track.angle_at(to_us + 1)),
        (None, None)
    );
}

#[test]
fn a_track_counts_its_reports() {
    let track = fit(&USUAL.reports(1), &EXPECTED).unwrap();
    assert!((650.0..2000.0).contains(&track.half_round_trip_us));
    assert!((track.chip_rate.unwrap() - 1.003).abs() < 1e-4);
    assert!(track.polls > 700);
}

#[test]
fn turns_without_a_track_are_distinguished_by_their_cause() {
    let reports = USUAL.reports(1);
    let mut causes = HashSet::new();
    let mut fails = |reports: &[StatusReport], expected: &JournaledTurn, named: &str| {
        let error = fit(reports, expected).unwrap_err();
        assert!(error.contains(named), "{error}");
        assert!(causes.insert(error));
    };
    fails(&reports[200..210], &EXPECTED, "10 reports");
    fails(&reports[..400], &EXPECTED, " %");
    let fast = JournaledTurn {
        degrees_per_second: 7.6,
        ..EXPECTED
    };
    fails(&reports, &fast, "7.6");
    let mad = Turn {
        wrong: 0.4,
        ..USUAL
    };
    fails(&mad.reports(1), &EXPECTED, " reports");
    let mut stamped = USUAL.reports(1);
    for report in &mut stamped {
        report.chip_us = report.chip_us.map(|us| us / 2);
    }
    fails(&stamped, &EXPECTED, "clock");
}

#[test]
fn reports_whose_request_is_uncertain_are_not_used() {
    let mut reports = USUAL.reports(1);
    for report in reports.iter_mut().step_by(2) {
        report.certain = false;
        report.came_us += 1_000_000;
    }
    let track = fit(&reports, &EXPECTED).unwrap();
    assert!(track.polls < 400 && track.outliers == 0);
}

proptest! {
    #[test]
    fn a_line_with_a_fifth_of_wrong_points_is_found(
        slope in -10.0..10.0f64,
        level in -1e6..1e6f64,
        wrong in proptest::collection::vec(proptest::option::weighted(0.2, -1e4..1e4f64), 100..200),
    ) {
        prop_assume!(wrong.iter().flatten().count() * 4 < wrong.len());
        let point = |(x, off): (f64, &Option<f64>)| (x, level + slope * x + off.unwrap_or(0.0));
        let xs = (0..).map(f64::from);
        let points: Vec<_> = xs.zip(&wrong).map(point).collect();
        let line = line::robust(&points, 1e-3).line;
        for x in [0.0, 50.0, 100.0] {
            prop_assert!((line.at(x) - level - slope * x).abs() < 2e-3);
        }
    }

    #[test]
    fn any_reports_give_a_track_or_an_error(
        reports in proptest::collection::vec(
            (any::<i32>(), any::<u16>(), -500.0..500.0f64, proptest::option::of(any::<u32>())), 0..80),
    ) {
        let report = |(asked, took, machine_deg, chip_us): &(i32, u16, f64, Option<u32>)| StatusReport {
            machine_deg: *machine_deg,
            chip_us: *chip_us,
            asked_us: Some(i64::from(*asked)),
            came_us: i64::from(*asked) + i64::from(*took),
            ..USUAL.report(0, &mut Chance(1))
        };
        let reports: Vec<StatusReport> = reports.iter().map(report).collect();
        if let Ok(track) = fit(&reports, &EXPECTED) {
            let (from_us, to_us) = track.constant_us();
            prop_assert!(from_us <= to_us && track.angle_at(from_us).unwrap().is_finite());
        }
    }
}

#[test]
fn reports_that_lie_on_no_line_are_not_compared_with_others() {
    let [some, all] = [30, 98].map(|outliers| uneven(outliers, 98));
    assert!(some.contains("30") && some.contains("98 reports"), "{some}");
    assert_eq!(all.matches("98").count(), 1, "{all}");
}
