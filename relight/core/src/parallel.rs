//! Parallel work on many rows, parts or frames. Without the feature `threads`, as in a browser, one comes after
//! the other. What is worked on must not depend on the order, so the results are the same.

use std::panic::{self, AssertUnwindSafe};
#[cfg(feature = "threads")]
use std::sync::atomic::{AtomicUsize, Ordering};
#[cfg(feature = "threads")]
use std::sync::{Mutex, PoisonError};
#[cfg(feature = "threads")]
use std::thread;

use thiserror::Error;

/// How many threads there are.
#[cfg(feature = "threads")]
pub fn threads() -> usize {
    rayon::current_num_threads()
}

/// How many threads there are.
#[cfg(not(feature = "threads"))]
pub fn threads() -> usize {
    1
}

/// The results of `work` for 0, 1, ... `count` - 1, in this order.
#[cfg(feature = "threads")]
pub fn map<R: Send>(count: usize, work: impl Fn(usize) -> R + Sync) -> Vec<R> {
    use rayon::prelude::*;
    (0..count).into_par_iter().map(&work).collect()
}

/// The results of `work` for 0, 1, ... `count` - 1, in this order.
#[cfg(not(feature = "threads"))]
pub fn map<R: Send>(count: usize, work: impl Fn(usize) -> R + Sync) -> Vec<R> {
    (0..count).map(work).collect()
}

/// Calls `work` with each item and its index.
#[cfg(feature = "threads")]
pub fn for_each<T: Send>(items: Vec<T>, work: impl Fn(usize, T) + Sync) {
    use rayon::prelude::*;
    items
        .into_par_iter()
        .enumerate()
        .for_each(|(index, item)| work(index, item));
}

/// Calls `work` with each item and its index.
#[cfg(not(feature = "threads"))]
pub fn for_each<T: Send>(items: Vec<T>, work: impl Fn(usize, T) + Sync) {
    for (index, item) in items.into_iter().enumerate() {
        work(index, item);
    }
}

/// The results of both: long jobs that themselves work on all threads.
///
/// The second gets a thread of its own, so that both sleep while they wait for rayon's threads. One of rayon's threads must
/// not sleep, as the others may wait for it: from there both go to rayon.
#[cfg(feature = "threads")]
pub fn join<A: Send, B: Send>(
    first: impl FnOnce() -> A + Send,
    second: impl FnOnce() -> B + Send,
) -> (A, B) {
    if rayon::current_thread_index().is_some() {
        return rayon::join(first, second);
    }
    thread::scope(|scope| {
        let second = scope.spawn(second);
        let first = first();
        match second.join() {
            Ok(second) => (first, second),
            Err(panic) => panic::resume_unwind(panic),
        }
    })
}

/// The results of both.
#[cfg(not(feature = "threads"))]
pub fn join<A: Send, B: Send>(
    first: impl FnOnce() -> A + Send,
    second: impl FnOnce() -> B + Send,
) -> (A, B) {
    (first(), second())
}

/// A job that panicked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("a fault of the program, described above: please report it")]
pub struct JobPanic;

/// The result of `job`; a panic ends only this job. Data that it changed must not be used after a panic.
///
/// # Errors
/// [`JobPanic`], whose reason the panic hook has printed.
pub fn caught<R>(job: impl FnOnce() -> R) -> Result<R, JobPanic> {
    panic::catch_unwind(AssertUnwindSafe(job)).map_err(|_| JobPanic)
}

/// The results of `job` for each item, in their order, at most `count` jobs at a time.
///
/// For long jobs that themselves work on all threads: each has a thread of its own. On rayon's threads a job could be
/// interrupted by the next one, so that more than `count` are under way.
#[cfg(feature = "threads")]
pub fn jobs<T: Sync, R: Send>(items: &[T], count: usize, job: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let results = Mutex::new(Vec::with_capacity(items.len()));
    thread::scope(|scope| {
        for _ in 0..count.clamp(1, items.len().max(1)) {
            scope.spawn(|| {
                loop {
                    let at = next.fetch_add(1, Ordering::Relaxed);
                    let Some(item) = items.get(at) else { break };
                    let result = job(item);
                    let mut results = results.lock().unwrap_or_else(PoisonError::into_inner);
                    results.push((at, result));
                }
            });
        }
    });
    let mut results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
    results.sort_by_key(|(at, _)| *at);
    results.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jobs_are_done_once_each_and_answer_in_their_order() {
        let items: Vec<usize> = (0..50).collect();
        for count in [1, 3, 80] {
            assert_eq!(jobs(&items, count, |item| 2 * item), map(50, |at| 2 * at));
        }
        assert!(jobs(&[] as &[u8], 4, |item| *item).is_empty());
    }

    #[test]
    fn no_more_jobs_than_asked_for_are_under_way_though_each_waits_for_all_threads() {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(8)
            .build()
            .unwrap();
        let (busy, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let job = |_: &usize| {
            let now = 1 + busy.fetch_add(1, Ordering::SeqCst);
            most.fetch_max(now, Ordering::SeqCst);
            pool.install(|| map(64, |_| thread::yield_now()));
            busy.fetch_sub(1, Ordering::SeqCst);
        };
        jobs(&(0..40).collect::<Vec<_>>(), 3, job);
        assert!(most.into_inner() <= 3);
    }

    #[test]
    fn both_jobs_of_a_join_are_done_on_any_kind_of_thread() {
        let both = || join(|| map(9, |at| at), || map(9, |at| 2 * at));
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .unwrap();
        assert_eq!(both(), pool.install(both));
    }

    #[test]
    fn a_panic_of_one_job_leaves_the_others() {
        let job = |&item: &usize| caught(|| assert_ne!(item, 2)).map(|()| item);
        let found = jobs(&[1, 2, 3], 2, job);
        assert_eq!(found, [Ok(1), Err(JobPanic), Ok(3)]);
    }
}
