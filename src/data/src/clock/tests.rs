#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test's own mistakes should be loud"
)]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use proptest::prelude::*;

use super::*;

const SECOND: Duration = Duration::from_secs(1);

fn ms(count: u64) -> Duration {
    Duration::from_millis(count)
}

#[test]
fn the_monotonic_clock_goes_forward_in_microseconds() {
    let clock = Clock::monotonic();
    let before = clock.now_us();
    clock.sleep(ms(20));
    assert!(clock.now_us() - before >= 20_000);
}

#[test]
fn clones_are_the_same_clock_and_two_virtual_ones_are_not() {
    let one = Clock::virtual_time();
    assert_eq!(one.clone(), one);
    assert_ne!(Clock::virtual_time(), one);
    assert_eq!(Clock::monotonic(), Clock::monotonic());
    assert_ne!(Clock::monotonic(), one);
}

#[test]
fn a_factor_that_is_no_speed_counts_as_real_time() {
    for factor in [0.0, -2.0, f64::NAN, f64::INFINITY] {
        assert_eq!(usable(factor), 1.0);
    }
}

#[test]
fn a_year_of_virtual_time_is_over_at_once_and_exactly() {
    let clock = Clock::virtual_time();
    let start_us = clock.now_us();
    for _ in 0..365 {
        clock.sleep(SECOND * 86_400);
    }
    assert_eq!(clock.now_us() - start_us, 365 * 86_400_000_000);
    clock.sleep_until(start_us);
    assert_eq!(clock.now_us() - start_us, 365 * 86_400_000_000);
}

#[test]
fn a_paced_clock_is_no_faster_than_its_pace() {
    let start = Instant::now();
    let clock = Clock::paced(100.0);
    let start_us = clock.now_us();
    clock.sleep(SECOND * 5);
    assert_eq!(clock.now_us() - start_us, 5_000_000);
    assert!(start.elapsed() >= ms(50));
}

#[test]
fn a_paced_clock_wakes_whoever_is_next_whatever_the_others_wait_for() {
    let clock = Clock::paced(1000.0);
    let _participant = clock.participate();
    let value = Waitable::new(&clock, 0);
    clock.scope(|scope| {
        scope.spawn("late", || clock.sleep(SECOND * 9)).unwrap();
        let waits = scope
            .spawn("waits", || {
                value.wait(|value| (*value == 1).then_some(()));
                clock.now_us()
            })
            .unwrap();
        clock.sleep(SECOND);
        let set_us = clock.now_us();
        value.update(|value| *value = 1);
        assert_eq!(waits.join().unwrap(), set_us);
    });
}

#[test]
fn no_time_passes_while_a_thread_that_takes_part_runs() {
    let clock = Clock::virtual_time();
    let _participant = clock.participate();
    let start_us = clock.now_us();
    let sleeper = clock
        .spawn("sleeper", {
            let clock = clock.clone();
            move || {
                clock.sleep(Duration::from_micros(1));
                clock.now_us()
            }
        })
        .unwrap();
    // Work that waits for a disk, or for a processor.
    std::thread::sleep(ms(50));
    assert_eq!(clock.now_us(), start_us);
    assert_eq!(sleeper.join().unwrap(), start_us + 1);
}

#[test]
fn who_is_notified_looks_before_time_passes() {
    let clock = Clock::virtual_time();
    let _participant = clock.participate();
    let value = Arc::new(Waitable::new(&clock, 0));
    let seen = clock
        .spawn("watcher", {
            let (clock, value) = (clock.clone(), Arc::clone(&value));
            move || {
                let mut seen = Vec::new();
                for wanted in 1..=100 {
                    value.wait(|value| (*value >= wanted).then_some(()));
                    seen.push(clock.now_us());
                }
                seen
            }
        })
        .unwrap();
    let mut set = Vec::new();
    for _ in 0..100 {
        clock.sleep(ms(1));
        set.push(clock.now_us());
        value.update(|value| *value += 1);
    }
    assert_eq!(seen.join().unwrap(), set);
}

#[test]
fn a_wait_ends_at_its_deadline_with_a_last_look() {
    for (clock, looks_before) in [(Clock::virtual_time(), 1), (Clock::monotonic(), 0)] {
        let value = Waitable::new(&clock, 0);
        let deadline_us = clock.after(ms(5));
        let mut looks = 0;
        let found = value.wait_until(deadline_us, |_| {
            looks += 1;
            (clock.now_us() >= deadline_us).then_some("late")
        });
        assert_eq!(found, Some("late"));
        // In real time the deadline can be over before the first look.
        assert!(looks > looks_before);
        assert_eq!(value.wait_for(ms(5), |_| None::<()>), None);
        assert_eq!(value.wait_until(0, |_| None::<()>), None);
    }
}

#[test]
fn a_deadlock_is_reported_with_threads_and_places() {
    let clock = Clock::virtual_time();
    let _participant = clock.participate();
    let value = Arc::new(Waitable::new(&clock, ()));
    let other = clock
        .spawn("other", {
            let value = Arc::clone(&value);
            move || value.wait(|()| None::<()>)
        })
        .unwrap();
    let report = catch_unwind(AssertUnwindSafe(|| value.wait(|()| None::<()>))).unwrap_err();
    let report = report.downcast::<String>().unwrap();
    assert!(report.contains("other at "), "{report}");
    assert!(report.matches("clock/tests.rs").count() >= 2, "{report}");
    while !other.is_finished() {
        std::thread::sleep(ms(1));
    }
    assert!(other.join().is_err());
}

#[test]
fn a_thread_that_panics_takes_no_part_any_more_and_its_end_is_seen() {
    let clock = Clock::virtual_time();
    let _participant = clock.participate();
    let broken = clock.spawn("broken", || panic!("as asked")).unwrap();
    clock.sleep(SECOND);
    assert!(broken.is_finished());
    assert!(broken.join().is_err());
    let body = catch_unwind(AssertUnwindSafe(|| {
        clock.scope(|scope| {
            scope.spawn("sleeper", || clock.sleep(SECOND)).unwrap();
            panic!("as asked");
        });
    }));
    assert!(body.is_err());
    clock.sleep(SECOND);
}

#[test]
fn a_scope_waits_for_its_threads_on_the_clock() {
    for clock in [Clock::virtual_time(), Clock::monotonic()] {
        let _participant = clock.participate();
        let ended = AtomicUsize::new(0);
        clock.scope(|scope| {
            for naps in [1, 20] {
                let (clock, ended) = (&clock, &ended);
                let sleeper = scope.spawn("sleeper", move || {
                    clock.sleep(ms(naps));
                    ended.fetch_add(1, Ordering::Release);
                });
                sleeper.unwrap();
            }
        });
        assert_eq!(ended.load(Ordering::Acquire), 2);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The defining property: however the system schedules the threads, each wakes exactly at its
    /// deadline, and all deadlines fire in order.
    #[test]
    fn every_thread_wakes_at_its_own_deadline_and_all_in_order(
        naps in proptest::collection::vec(proptest::collection::vec(1..5000_u64, 1..20), 1..6),
        paced in any::<bool>(),
    ) {
        let clock = if paced { Clock::paced(1e6) } else { Clock::virtual_time() };
        let start_us = clock.now_us();
        let log = Mutex::new(Vec::new());
        let participant = clock.participate();
        clock.scope(|scope| {
            for naps in &naps {
                let (clock, log) = (&clock, &log);
                scope.spawn("napper", move || {
                    let mut due_us = start_us;
                    for nap in naps {
                        clock.sleep(Duration::from_micros(*nap));
                        due_us += *nap as i64;
                        log.lock().unwrap().push((clock.now_us(), due_us));
                    }
                }).unwrap();
            }
        });
        drop(participant);
        let log = log.into_inner().unwrap();
        prop_assert_eq!(log.len(), naps.iter().map(Vec::len).sum::<usize>());
        prop_assert!(log.iter().all(|(now_us, due_us)| now_us == due_us));
        prop_assert!(log.is_sorted());
        let longest = naps.iter().map(|naps| naps.iter().sum::<u64>()).max().unwrap_or(0);
        prop_assert_eq!(clock.now_us() - start_us, longest as i64);
    }

    /// Values handed over through a waitable come at the time they were given, whoever waits how.
    #[test]
    fn what_is_handed_over_comes_without_delay(
        gaps in proptest::collection::vec(0..3000_u64, 1..30),
        timeout_us in 1..2000_u64,
    ) {
        let clock = Clock::virtual_time();
        let participant = clock.participate();
        let slot = Waitable::new(&clock, None);
        let late = clock.scope(|scope| {
            let taker = scope.spawn("taker", || {
                let mut late = 0;
                for _ in &gaps {
                    let given_us: i64 = loop {
                        let taken = slot.wait_for(Duration::from_micros(timeout_us), Option::take);
                        if let Some(given_us) = taken {
                            break given_us;
                        }
                    };
                    late += clock.now_us() - given_us;
                    slot.notify();
                }
                late
            }).unwrap();
            for gap in &gaps {
                clock.sleep(Duration::from_micros(*gap));
                slot.wait(|slot| slot.is_none().then_some(()));
                slot.update(|slot| *slot = Some(clock.now_us()));
            }
            taker.join().unwrap()
        });
        drop(participant);
        prop_assert_eq!(late, 0);
    }
}
