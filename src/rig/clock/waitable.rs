//! A value whose changes can be waited for until a time of a clock.

use std::panic::Location;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::Clock;
use super::scheduler::{Ended, WaitId};

/// A value behind a lock, whose changes can be waited for until a deadline on a clock.
///
/// Who changes it through [`Waitable::lock`] calls [`Waitable::notify`] afterwards;
/// [`Waitable::update`] does both. Those who wait are woken by either and look again. Hold no lock
/// while you wait, and wait for nothing while you look.
#[derive(Debug)]
pub struct Waitable<T> {
    clock: Clock,
    id: WaitId,
    value: Mutex<T>,
    changed: Condvar,
}

impl<T> Waitable<T> {
    /// A value whose waits go by `clock`.
    pub fn new(clock: &Clock, value: T) -> Self {
        Self {
            clock: clock.clone(),
            id: WaitId::unique(),
            value: Mutex::new(value),
            changed: Condvar::new(),
        }
    }

    /// The clock that its waits go by.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// The value, for a moment. One that a panicking thread has left behind is given as it is.
    pub fn lock(&self) -> MutexGuard<'_, T> {
        self.value.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Wakes all who wait. On a virtual clock no time passes before they have looked.
    pub fn notify(&self) {
        match self.clock.scheduler() {
            Some(scheduler) => scheduler.notify(self.id),
            None => self.changed.notify_all(),
        }
    }

    /// Changes the value and wakes all who wait.
    pub fn update<R>(&self, change: impl FnOnce(&mut T) -> R) -> R {
        let changed = change(&mut self.lock());
        self.notify();
        changed
    }

    /// Looks at the value, and again after each change, until `look` finds something.
    #[track_caller]
    pub fn wait<R>(&self, mut look: impl FnMut(&mut T) -> Option<R>) -> R {
        let place = Location::caller();
        loop {
            if let Some(found) = self.watch(None, place, &mut look) {
                return found;
            }
            // Only while a deadlock unwinds all threads: the others end, each for itself.
            std::thread::yield_now();
        }
    }

    /// Looks at the value, and again after each change, until `look` finds something or `timeout`
    /// is over; then once more.
    #[track_caller]
    pub fn wait_for<R>(
        &self,
        timeout: Duration,
        look: impl FnMut(&mut T) -> Option<R>,
    ) -> Option<R> {
        self.wait_until(self.clock.after(timeout), look)
    }

    /// Looks at the value, and again after each change, until `look` finds something or the clock
    /// shows `deadline_us`; then once more.
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
        let _part = self.clock.take_part();
        let mut value = self.lock();
        loop {
            if let Some(found) = look(&mut value) {
                return Some(found);
            }
            value = self.wait_for_change(value, deadline_us, place)?;
        }
    }

    /// Gives the lock away until something changes or the deadline comes; `None` where it is past.
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
                Ended::Woken => Some(self.lock()),
                Ended::Abandoned => None,
            };
        }
        let Some(deadline_us) = deadline_us else {
            let woken = self.changed.wait(value);
            return Some(woken.unwrap_or_else(PoisonError::into_inner));
        };
        let left = u64::try_from(deadline_us.saturating_sub(self.clock.now_us())).ok();
        let left = self
            .clock
            .real(Duration::from_micros(left.filter(|left| *left > 0)?));
        let woken = self.changed.wait_timeout(value, left);
        Some(woken.unwrap_or_else(PoisonError::into_inner).0)
    }
}
