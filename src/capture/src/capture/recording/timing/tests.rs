use super::*;

/// SplitMix64 (Steele, Lea and Flood, *Fast splittable pseudorandom number generators*, 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }

    /// From -1 to 1.
    fn either_way(&mut self) -> f64 {
        self.next() as f64 / u64::MAX as f64 * 2.0 - 1.0
    }
}

/// A camera's stamps with seeded gaps, and what is missing in truth: (exposure, count, before).
struct Made {
    stamps: Vec<FrameStamp>,
    fps: f64,
    missing: Vec<(u64, u64, usize)>,
}

/// 1 to 20 gaps of 1 to 10 frames in 300 to 1500 exposures of a camera whose rate is up to 1 % off,
/// and whose stamps are off by up to 40 % of a period either way.
fn made(seed: u64) -> Made {
    let mut random = Random(seed);
    let exposures = 300 + random.below(1201);
    let fps = [15.0, 24.0, 25.0, 30.0, 60.0][random.below(5) as usize];
    let period = 1e6 / fps * (1.0 + 0.01 * random.either_way());
    let jitter = [0.0, 0.02, 0.2, 0.4][random.below(4) as usize];
    let mut lost = vec![false; exposures as usize];
    for _ in 0..=random.below(20) {
        let (at, count) = (1 + random.below(exposures - 12), 1 + random.below(10));
        (at..at + count).for_each(|exposure| lost[exposure as usize] = true);
    }
    let begun = random.below(1 << 40) as f64;
    let counted_from = random.below(1 << 33);
    let mut made = Made {
        stamps: Vec::new(),
        fps,
        missing: Vec::new(),
    };
    for exposure in 0..exposures {
        if lost[exposure as usize] {
            match made.missing.last_mut() {
                Some(last) if last.0 + last.1 == exposure => last.1 += 1,
                _ => made.missing.push((exposure, 1, made.stamps.len())),
            }
            continue;
        }
        let due = begun + period * (exposure as f64 + jitter * random.either_way());
        made.stamps.push(FrameStamp {
            sequence: Some(counted_from + exposure),
            t_us: due.round() as i64,
        });
    }
    made
}

/// What is missing between delivered frames.
fn gaps_of(timing: &FrameTiming) -> Vec<MissingFrames> {
    gaps(&timing.exposures, 0)
}

fn found(timing: &FrameTiming) -> Vec<(u64, u64, usize)> {
    let all = gaps_of(timing).into_iter();
    all.map(|missing| (missing.exposure, missing.count, missing.before))
        .collect()
}

/// How many exposures are missing.
fn missing(timing: &FrameTiming) -> u64 {
    gaps_of(timing).iter().map(|missing| missing.count).sum()
}

fn every_gap_is_found(seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let made = made(seed);
        let timing = FrameTiming::from_stamps(&made.stamps, made.fps);
        assert_eq!(found(&timing), made.missing, "seed {seed}");
        assert!(
            timing.anomalies.is_empty(),
            "seed {seed}: {:?}",
            timing.anomalies
        );
        assert!(timing.counts);
    }
}

fn every_gap_is_found_without_a_counter(seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let mut made = made(seed);
        let stands = (seed % 2 == 0).then_some(7);
        made.stamps
            .iter_mut()
            .for_each(|stamp| stamp.sequence = stands);
        let timing = FrameTiming::from_stamps(&made.stamps, made.fps);
        assert_eq!(found(&timing), made.missing, "seed {seed}");
        assert!(
            timing.anomalies.is_empty(),
            "seed {seed}: {:?}",
            timing.anomalies
        );
    }
}

#[test]
fn every_gap_is_found_at_its_index_and_nothing_else() {
    every_gap_is_found(0..10_000);
}

#[test]
fn every_gap_is_found_by_time_stamps_alone() {
    every_gap_is_found_without_a_counter(0..10_000);
}

/// A camera of 30 frames/s without gaps, with some jitter.
fn regular(frames: u64) -> Vec<FrameStamp> {
    let mut random = Random(5);
    (0..frames)
        .map(|n| FrameStamp {
            sequence: Some(900 + n),
            t_us: (33_333.3 * (n as f64 + 0.1 * random.either_way())) as i64,
        })
        .collect()
}

#[test]
fn a_gap_in_the_time_stamps_that_the_driver_did_not_count_is_missing_and_reported() {
    let mut stamps = regular(600);
    stamps.drain(250..253);
    for (n, stamp) in stamps.iter_mut().enumerate() {
        stamp.sequence = Some(n as u64);
    }
    let timing = FrameTiming::from_stamps(&stamps, 30.0);
    let reported = TimingAnomaly::Contradiction {
        before: 250,
        counted: 1,
        timed: 4,
    };
    assert_eq!(timing.anomalies, [reported]);
    assert_eq!(found(&timing), [(250, 3, 250)]);
}

#[test]
fn a_jump_of_the_counter_that_no_time_stamp_shows_is_reported_and_nothing_is_missing() {
    let mut stamps = regular(600);
    for stamp in &mut stamps[400..] {
        stamp.sequence = stamp.sequence.map(|sequence| sequence + 5);
    }
    let timing = FrameTiming::from_stamps(&stamps, 30.0);
    assert!(gaps_of(&timing).is_empty());
    let reported = TimingAnomaly::Contradiction {
        before: 400,
        counted: 6,
        timed: 1,
    };
    assert_eq!(timing.anomalies, [reported]);
}

#[test]
fn a_counter_that_repeats_a_number_and_catches_up_loses_nothing() {
    let mut stamps = regular(300);
    stamps[100].sequence = stamps[99].sequence;
    let timing = FrameTiming::from_stamps(&stamps, 30.0);
    assert_eq!((timing.counts, missing(&timing)), (true, 0));
    assert_eq!(timing.exposures, (0..300).collect::<Vec<_>>());
    assert!(!timing.anomalies.is_empty());
}

#[test]
fn a_counter_that_starts_anew_is_reported_and_loses_nothing() {
    let mut stamps = regular(300);
    for (n, stamp) in stamps[120..].iter_mut().enumerate() {
        stamp.sequence = Some(n as u64);
    }
    let timing = FrameTiming::from_stamps(&stamps, 30.0);
    assert_eq!(missing(&timing), 0);
    assert!(matches!(
        timing.anomalies[..],
        [TimingAnomaly::Contradiction {
            before: 120,
            timed: 1,
            ..
        }]
    ));
}

#[test]
fn a_single_late_stamp_is_reported_and_is_no_gap() {
    let mut stamps = regular(300);
    stamps[150].t_us += 36_000;
    let timing = FrameTiming::from_stamps(&stamps, 30.0);
    assert_eq!(missing(&timing), 0);
    assert_eq!(
        timing.anomalies,
        [TimingAnomaly::OddTime { frame: 150, off: 1 }]
    );
}

#[test]
fn irregular_stamps_leave_the_counter_as_evidence() {
    let mut random = Random(11);
    let mut stamps = regular(400);
    for (n, stamp) in stamps.iter_mut().enumerate() {
        stamp.t_us = 33_333 * n as i64 + random.below(200_000) as i64;
    }
    stamps.drain(77..79);
    let timing = FrameTiming::from_stamps(&stamps, 30.0);
    assert_eq!(found(&timing), [(77, 2, 77)]);
    assert!(timing.anomalies.contains(&TimingAnomaly::Irregular));
}

#[test]
fn a_camera_at_half_the_rate_is_reported_with_and_without_a_counter() {
    for counts in [true, false] {
        let stamps: Vec<FrameStamp> = (0..500_u64)
            .map(|n| FrameStamp {
                sequence: counts.then_some(n),
                t_us: 66_667 * n as i64,
            })
            .collect();
        let timing = FrameTiming::from_stamps(&stamps, 30.0);
        let reported = timing.anomalies.iter().find_map(|anomaly| match anomaly {
            TimingAnomaly::Rate { measured, .. } => Some(*measured),
            _ => None,
        });
        assert!(
            (reported.unwrap() - 15.0).abs() < 0.1,
            "{:?}",
            timing.anomalies
        );
    }
}

#[test]
fn no_stamps_make_it_panic() {
    for seed in 0..300 {
        let mut random = Random(seed);
        let stamps: Vec<FrameStamp> = (0..random.below(40))
            .map(|_| FrameStamp {
                sequence: (random.below(4) > 0).then(|| random.next()),
                t_us: random.next().cast_signed(),
            })
            .collect();
        let fps = [30.0, 0.0, f64::NAN, -1.0, 1e300][random.below(5) as usize];
        let timing = FrameTiming::from_stamps(&stamps, fps);
        assert_eq!(timing.exposures.len(), stamps.len());
        assert!(timing.exposures.windows(2).all(|pair| pair[0] < pair[1]));
    }
}
