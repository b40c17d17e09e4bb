//! Threads that participate in a clock, and the waits for their ends.

use std::io;
use std::marker::PhantomData;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
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

/// A thread started by [`Clock::spawn`] or [`Scope::spawn`]. Dropping it detaches the thread.
#[derive(Debug)]
pub struct JoinHandle<T>(Arc<Waitable<Option<thread::Result<T>>>>);

impl<T> JoinHandle<T> {
    /// Waits until the thread has ended; returns its result.
    ///
    /// # Errors
    /// The panic of the thread.
    #[track_caller]
    pub fn join(self) -> thread::Result<T> {
        self.0.wait(Option::take)
    }

    /// Whether the thread has ended.
    pub fn is_finished(&self) -> bool {
        self.0.lock().is_some()
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
        let (run, handle) = self.announced(work, ());
        thread::Builder::new().name(name.to_owned()).spawn(run)?;
        Ok(handle)
    }

    /// Runs `body`, which may start threads that borrow local values, and waits for their ends.
    ///
    /// # Panics
    /// If a thread panics whose handle was dropped.
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

    /// What a participating thread has to run, and the handle for its end. `at_end` is dropped when `work` is done.
    fn announced<T: Send, W: FnOnce() -> T + Send, E: Send>(
        &self,
        work: W,
        at_end: E,
    ) -> (impl FnOnce() + Send + use<T, W, E>, JoinHandle<T>) {
        let expected = Expected::new(self);
        let ended = Arc::new(Waitable::new(self, None));
        let handle = JoinHandle(Arc::clone(&ended));
        let run = move || {
            // Until everybody has been told of the end.
            let _participant = expected.arrive();
            let _at_end = at_end;
            let result = catch_unwind(AssertUnwindSafe(work));
            ended.update(|ended| *ended = Some(result));
            // A panic of which nobody will learn by joining goes on, to the scope if there is one.
            if Arc::strong_count(&ended) == 1
                && let Some(Err(panic)) = ended.lock().take()
            {
                resume_unwind(panic);
            }
        };
        (run, handle)
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
    ) -> io::Result<JoinHandle<T>> {
        *self.open.lock() += 1;
        let (run, handle) = self
            .clock
            .announced(work, CountDown(Arc::clone(&self.open)));
        let thread = thread::Builder::new().name(name.to_owned());
        thread.spawn_scoped(self.scope, run)?;
        Ok(handle)
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
