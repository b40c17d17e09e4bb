//! Threads that participate in a clock, and the waits for their ends.

use std::io;
use std::marker::PhantomData;
use std::sync::Arc;
use std::thread;

use super::{Clock, Waitable};

/// While this exists, the thread that created it participates in the clock: virtual time passes only
/// while that thread waits on the clock.
#[derive(Debug)]
#[must_use = "the thread participates as long as this exists"]
pub struct Participant {
    clock: Clock,
    /// Participation belongs to one thread.
    _not_send: PhantomData<*const ()>,
}

impl Participant {
    fn new(clock: &Clock) -> Self {
        Self {
            clock: clock.clone(),
            _not_send: PhantomData,
        }
    }
}

impl Drop for Participant {
    fn drop(&mut self) {
        if let Some(scheduler) = self.clock.scheduler() {
            scheduler.leave();
        }
    }
}

/// A thread started by [`Clock::spawn`]. Dropping it detaches the thread.
#[derive(Debug)]
pub struct JoinHandle<T> {
    thread: thread::JoinHandle<T>,
    ended: Arc<Waitable<bool>>,
}

impl<T> JoinHandle<T> {
    /// Waits until the thread has ended; returns its result.
    ///
    /// # Errors
    /// The panic of the thread.
    #[track_caller]
    pub fn join(self) -> thread::Result<T> {
        self.ended.wait(|ended| ended.then_some(()));
        self.thread.join()
    }

    /// Whether the thread has ended.
    pub fn is_finished(&self) -> bool {
        *self.ended.lock()
    }
}

/// A scope for threads that end before [`Clock::scope`] returns.
#[derive(Debug)]
pub struct Scope<'scope, 'env: 'scope> {
    scope: &'scope thread::Scope<'scope, 'env>,
    clock: Clock,
    /// Number of threads that have not ended.
    open: Arc<Waitable<usize>>,
}

/// A thread started by [`Scope::spawn`].
#[derive(Debug)]
pub struct ScopedJoinHandle<'scope, T> {
    thread: thread::ScopedJoinHandle<'scope, T>,
    ended: Arc<Waitable<bool>>,
}

impl<T> ScopedJoinHandle<'_, T> {
    /// Waits until the thread has ended; returns its result.
    ///
    /// # Errors
    /// The panic of the thread.
    #[track_caller]
    pub fn join(self) -> thread::Result<T> {
        self.ended.wait(|ended| ended.then_some(()));
        self.thread.join()
    }

    /// Whether the thread has ended.
    pub fn is_finished(&self) -> bool {
        *self.ended.lock()
    }
}

impl Clock {
    /// Makes this thread a participant until the returned value is dropped. Other threads may also
    /// wait on the clock; they participate during their waits only.
    pub fn participate(&self) -> Participant {
        if let Some(scheduler) = self.scheduler() {
            scheduler.enter();
        }
        Participant::new(self)
    }

    /// Starts a participating thread. No time passes until it runs.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn spawn<T: Send + 'static>(
        &self,
        name: &str,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> io::Result<JoinHandle<T>> {
        let expected = Expected::new(self);
        let ended = Arc::new(Waitable::new(self, false));
        let end = SetAtEnd(Arc::clone(&ended));
        let thread = thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || {
                let _participant = expected.arrive();
                let _end = end;
                work()
            })?;
        Ok(JoinHandle { thread, ended })
    }

    /// Runs `body`, which may start threads that borrow local values, and waits for their ends.
    pub fn scope<'env, T>(&self, body: impl for<'scope> FnOnce(&Scope<'scope, 'env>) -> T) -> T {
        thread::scope(|scope| {
            let scope = Scope {
                scope,
                clock: self.clone(),
                open: Arc::new(Waitable::new(self, 0)),
            };
            let _all_ended = WaitForAll(Arc::clone(&scope.open));
            body(&scope)
        })
    }
}

impl<'scope> Scope<'scope, '_> {
    /// Starts a participating thread. No time passes until it runs.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn spawn<T: Send + 'scope>(
        &self,
        name: &str,
        work: impl FnOnce() -> T + Send + 'scope,
    ) -> io::Result<ScopedJoinHandle<'scope, T>> {
        let expected = Expected::new(&self.clock);
        let ended = Arc::new(Waitable::new(&self.clock, false));
        *self.open.lock() += 1;
        let count = CountDown(Arc::clone(&self.open));
        let end = SetAtEnd(Arc::clone(&ended));
        let thread =
            thread::Builder::new()
                .name(name.to_owned())
                .spawn_scoped(self.scope, move || {
                    let _participant = expected.arrive();
                    let (_count, _end) = (count, end);
                    work()
                })?;
        Ok(ScopedJoinHandle { thread, ended })
    }
}

/// A thread about to start: counts as running until it has started or failed to.
struct Expected(Option<Clock>);

impl Expected {
    fn new(clock: &Clock) -> Self {
        if let Some(scheduler) = clock.scheduler() {
            scheduler.expect();
        }
        Self(Some(clock.clone()))
    }

    /// Makes this thread the announced participant.
    fn arrive(mut self) -> Option<Participant> {
        let clock = self.0.take()?;
        if let Some(scheduler) = clock.scheduler() {
            scheduler.arrive();
        }
        Some(Participant::new(&clock))
    }
}

impl Drop for Expected {
    fn drop(&mut self) {
        if let Some(scheduler) = self.0.as_ref().and_then(Clock::scheduler) {
            scheduler.expect_no_more();
        }
    }
}

/// Marks the thread as ended, also after a panic.
struct SetAtEnd(Arc<Waitable<bool>>);

impl Drop for SetAtEnd {
    fn drop(&mut self) {
        self.0.update(|ended| *ended = true);
    }
}

/// Marks one of the scope's threads as ended.
struct CountDown(Arc<Waitable<usize>>);

impl Drop for CountDown {
    fn drop(&mut self) {
        self.0.update(|open| *open -= 1);
    }
}

/// Waits for the scope's threads, also if its body panics.
struct WaitForAll(Arc<Waitable<usize>>);

impl Drop for WaitForAll {
    fn drop(&mut self) {
        self.0.wait(|open| (*open == 0).then_some(()));
    }
}
