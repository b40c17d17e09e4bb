//! Work on many rows, parts or frames side by side. Without the feature `threads`, as in a browser, one comes after
//! the other. What is worked on must not depend on the order, so the results are the same.

/// How many threads there are.
#[cfg(feature = "threads")]
#[must_use]
pub fn threads() -> usize {
    rayon::current_num_threads()
}

/// How many threads there are.
#[cfg(not(feature = "threads"))]
#[must_use]
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

/// The results of both.
#[cfg(feature = "threads")]
pub fn join<A: Send, B: Send>(
    first: impl FnOnce() -> A + Send,
    second: impl FnOnce() -> B + Send,
) -> (A, B) {
    rayon::join(first, second)
}

/// The results of both.
#[cfg(not(feature = "threads"))]
pub fn join<A: Send, B: Send>(
    first: impl FnOnce() -> A + Send,
    second: impl FnOnce() -> B + Send,
) -> (A, B) {
    (first(), second())
}
