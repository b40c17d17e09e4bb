use proptest::prelude::*;

use crate::capture::recording::trimmer::*;
use crate::capture::tests::frame;

/// Plays frames into a trimmer, announces the window when frame `at` has come, and answers the
/// numbers of the frames selected, and the count.
fn cut(frames: impl Iterator<Item = Frame>, window: Window, at: usize) -> (Vec<i64>, TurnCount) {
    let mut trimmer = Trimmer::new(30.0, None);
    let mut selected = Vec::new();
    for (n, frame) in frames.enumerate() {
        selected.extend(trimmer.push(Arc::new(frame)));
        if n == at {
            selected.extend(trimmer.announce(window));
        }
    }
    let (rest, count) = trimmer.end();
    selected.extend(rest);
    let number = |selected: &TurnFrame| (selected.frame.t_us as f64 / 33_333.3).round() as i64;
    (selected.iter().map(number).collect(), count)
}

/// How many exposures were not delivered.
fn missing(count: &TurnCount) -> u64 {
    count.missing.iter().map(|missing| missing.count).sum()
}

fn frames(numbers: impl Iterator<Item = u64>) -> impl Iterator<Item = Frame> {
    numbers.map(|n| {
        let mut frame = frame(n);
        frame.t_us = (33_333.3 * n as f64) as i64;
        frame
    })
}

fn seconds(from: f64, to: f64) -> Window {
    Window::lasting((from * 1e6) as i64, ((to - from) * 1e6) as i64)
}

#[test]
fn fifty_seconds_at_thirty_frames_a_second_are_1500_frames() {
    for at in [0, 40] {
        let (selected, count) = cut(frames(0..1600), seconds(1.01, 51.01), at);
        assert_eq!(selected, (31..1531).collect::<Vec<_>>());
        assert_eq!((count.expected, missing(&count)), (1500, 0));
        assert!(count.anomalies.is_empty());
    }
}

#[test]
fn a_stream_that_ends_with_the_turn_is_whole() {
    let (selected, count) = cut(frames(0..1500), seconds(0.0, 50.0), 0);
    assert_eq!(selected.len(), 1500);
    assert_eq!((count.expected, missing(&count)), (1500, 0));
}

#[test]
fn frames_missing_at_both_ends_and_between_are_counted_in_the_turn() {
    let lost = |n: &u64| ![29, 30, 31, 100, 101, 328, 329, 330].contains(n);
    let (selected, count) = cut(frames((0..400).filter(lost)), seconds(0.99, 10.99), 0);
    assert_eq!(selected.len(), 300 - 6);
    let found: Vec<_> = count
        .missing
        .iter()
        .map(|m| (m.exposure, m.count, m.before))
        .collect();
    assert_eq!(found, [(0, 2, 0), (70, 2, 68), (298, 2, 294)]);
}

#[test]
fn a_turn_that_is_announced_too_late_lacks_its_begin() {
    let (selected, count) = cut(frames(0..600), seconds(1.01, 11.01), 200);
    assert_eq!(count.expected, 300);
    assert_eq!(count.exposures.len(), selected.len());
    assert_eq!(count.missing[0].before, 0);
    assert_eq!(missing(&count), 300 - selected.len() as u64);
    assert!(missing(&count) > 40);
}

#[test]
fn a_stream_that_breaks_off_lacks_the_rest() {
    let (selected, count) = cut(frames(0..130), seconds(0.99, 10.99), 0);
    assert_eq!(selected.len(), 100);
    assert_eq!(missing(&count), 200);
    assert_eq!(count.missing.last().unwrap().before, 100);
}

#[test]
fn without_any_frame_all_of_the_turn_is_missing() {
    let (selected, count) = cut(frames(0..3), seconds(5.0, 15.0), 0);
    assert!(selected.is_empty());
    assert_eq!((count.expected, missing(&count)), (300, 300));
}

#[test]
fn a_chain_of_frames_is_recorded_from_its_key_frame_on() {
    let mut trimmer = Trimmer::new(30.0, Some(|data| data == [1]));
    let mut selected = Vec::new();
    for (n, mut frame) in frames(0..100).enumerate() {
        frame.data = vec![u8::from(n % 12 == 0)];
        selected.extend(trimmer.push(Arc::new(frame)));
        if n == 35 {
            selected.extend(trimmer.announce(seconds(1.01, 2.01)));
        }
    }
    let (rest, count) = trimmer.end();
    selected.extend(rest);
    // The turn begins with frame 31, the chain with frame 24.
    let lead = selected
        .iter()
        .filter(|selected| selected.delivered.is_none())
        .count();
    assert_eq!((lead, selected.len() - lead, count.expected), (7, 30, 30));
    assert_eq!(selected[0].frame.data, [1]);
}

#[test]
fn a_chain_is_kept_from_its_key_frame_on_however_long_ago_that_was() {
    let mut trimmer = Trimmer::new(30.0, Some(|data| data == [1]));
    let mut selected = Vec::new();
    for (n, mut frame) in frames(0..600).enumerate() {
        frame.data = vec![u8::from(n % 250 == 0)];
        selected.extend(trimmer.push(Arc::new(frame)));
        if n == 480 {
            selected.extend(trimmer.announce(seconds(15.01, 17.01)));
        }
    }
    let (rest, count) = trimmer.end();
    selected.extend(rest);
    assert_eq!((count.expected, missing(&count)), (60, 0));
    assert_eq!(selected[0].frame.data, [1]);
    // From frame 250 on, before frame 451.
    assert_eq!(selected.len(), 201 + 60);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn a_steady_stream_gives_exactly_the_turn_s_frames_wherever_it_begins(
        from in 1_000_000_i64..2_000_000, rate in -0.0002_f64..0.0002, jitter in 0_i64..13_000,
        seed in any::<u64>(),
    ) {
        let window = Window::lasting(from, 20_000_000);
        let mut state = seed;
        let stream = (0..720_u64).map(|n| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let off = (state >> 33) as i64 % (2 * jitter + 1) - jitter;
            let mut frame = frame(n);
            frame.t_us = (33_333.333 * (1.0 + rate) * n as f64) as i64 + off;
            frame
        });
        let (selected, count) = cut(stream, window, 0);
        prop_assert_eq!((count.expected, missing(&count)), (600, 0), "{:?}", count.missing);
        prop_assert_eq!(selected.len(), 600);
    }
}
