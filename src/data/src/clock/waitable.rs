//! A value whose changes threads can wait for.

use std::panic::Location;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::Clock;
use super::scheduler::{WaitId, WaitOutcome};

/// A value behind a lock, with waits for its changes that have deadlines on a clock.
///
/// After a change through [`Waitable::lock`], call [`Waitable::notify`]; [`Waitable::update`] does
/// both. The closure `look` of a wait is called with the value locked: it must not wait for anything
/// itself.
#[derive(Debug)]
pub struct Waitable<T> {
    clock: Clock,
    id: WaitId,
    value: Mutex<T>,
    changed: Condvar,
}

impl<T> Waitable<T> {
    /// A value whose waits use `clock`.
    pub fn new(clock: &Clock, value: T) -> Self {
        Self {
            clock: clock.clone(),
            id: WaitId::unique(),
            value: Mutex::new(value),
            changed: Condvar::new(),
        }
    }

    /// The clock of its waits.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// Locks the value, also if a thread has panicked while it had the lock.
    pub fn lock(&self) -> MutexGuard<'_, T> {
        self.value.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Wakes all waiting threads. On a virtual clock, no time passes until they have looked.
    pub fn notify(&self) {
        match self.clock.scheduler() {
            Some(scheduler) => scheduler.notify(self.id),
            None => self.changed.notify_all(),
        }
    }

    /// Changes the value and wakes all waiting threads.
    pub fn update<R>(&self, change: impl FnOnce(&mut T) -> R) -> R {
        let changed = change(&mut self.lock());
        self.notify();
        changed
    }

    /// Calls `look` now and after each change, until it returns something.
    #[track_caller]
    pub fn wait<R>(&self, mut look: impl FnMut(&mut T) -> Option<R>) -> R {
        let place = Location::caller();
        loop {
            if let Some(found) = self.watch(None, place, &mut look) {
                return found;
            }
            // Reached only while all threads unwind because of a deadlock.
            std::thread::yield_now();
        }
    }

    /// Calls `look` now, after each change, and a last time after `timeout`, until it returns
    /// something.
    #[track_caller]
    pub fn wait_for<R>(
        &self,
        timeout: Duration,
        look: impl FnMut(&mut T) -> Option<R>,
    ) -> Option<R> {
        self.wait_until(self.clock.after(timeout), look)
    }

    /// Calls `look` now, after each change, and a last time at `deadline_us`, until it returns
    /// something.
    #[track_caller]
    pub fn wait_until<R>(
        &self,
        deadline_us: i64,
        mut look: impl FnMut(&mut T) -> Option<R>,
    ) -> Option<R> {
        self.watch(Some(deadline_us), Location::caller(), &mut look)
    }

    fn watch<R>(
        &self,
        deadline_us: Option<i64>,
        place: &'static Location<'static>,
        look: &mut dyn FnMut(&mut T) -> Option<R>,
    ) -> Option<R> {
        let _participant = self.clock.participate();
        let mut value = self.lock();
        loop {
            if let Some(found) = look(&mut value) {
                return Some(found);
            }
            value = self.wait_for_change(value, deadline_us, place)?;
        }
    }

    /// Releases the lock until a change or the deadline; `None` if the deadline has passed.
    fn wait_for_change<'a>(
        &'a self,
        value: MutexGuard<'a, T>,
        deadline_us: Option<i64>,
        place: &'static Location<'static>,
    ) -> Option<MutexGuard<'a, T>> {
        if let Some(scheduler) = self.clock.scheduler() {
            let ticket = scheduler.register(Some(self.id), deadline_us, place)?;
            drop(value);
            return match scheduler.block(ticket) {
                WaitOutcome::Woken => Some(self.lock()),
                WaitOutcome::Abandoned => None,
            };
        }
        let Some(deadline_us) = deadline_us else {
            let woken = self.changed.wait(value);
            return Some(woken.unwrap_or_else(PoisonError::into_inner));
        };
        let left = u64::try_from(deadline_us.saturating_sub(self.clock.now_us())).ok();
        let left = Duration::from_micros(left.filter(|left| *left > 0)?);
        let woken = self.changed.wait_timeout(value, left);
        Some(woken.unwrap_or_else(PoisonError::into_inner).0)
    }
}
