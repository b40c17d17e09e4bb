//! Threads that take part in a clock, and waiting for their ends.

use std::io;
use std::marker::PhantomData;
use std::sync::Arc;
use std::thread;

use super::{Clock, Waitable};

/// While this lives, the thread that made it takes part in its clock: virtual time passes only
/// while that thread waits on the clock.
#[derive(Debug)]
#[must_use = "the thread takes part as long as this lives"]
pub struct Participant {
    clock: Clock,
    /// A part is the thread's own.
    _not_send: PhantomData<*const ()>,
}

impl Participant {
    fn of(clock: &Clock) -> Self {
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

/// A thread started by [`Clock::spawn`]. Dropped, it lets the thread go on by itself.
#[derive(Debug)]
pub struct JoinHandle<T> {
    thread: thread::JoinHandle<T>,
    ended: Arc<Waitable<bool>>,
}

impl<T> JoinHandle<T> {
    /// Waits until the thread has ended; gives what it gave, or what it panicked with.
    ///
    /// # Errors
    /// What the thread panicked with.
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

/// Threads that end before [`Clock::scope`] does.
#[derive(Debug)]
pub struct Scope<'scope, 'env: 'scope> {
    scope: &'scope thread::Scope<'scope, 'env>,
    clock: Clock,
    /// How many threads have not ended.
    open: Arc<Waitable<usize>>,
}

/// A thread started by [`Scope::spawn`].
#[derive(Debug)]
pub struct ScopedJoinHandle<'scope, T> {
    thread: thread::ScopedJoinHandle<'scope, T>,
    ended: Arc<Waitable<bool>>,
}

impl<T> ScopedJoinHandle<'_, T> {
    /// Waits until the thread has ended; gives what it gave, or what it panicked with.
    ///
    /// # Errors
    /// What the thread panicked with.
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
    /// Lets this thread take part until what is given is dropped. A thread that only now and then
    /// waits on the clock does without: it takes part while it waits.
    pub fn take_part(&self) -> Participant {
        if let Some(scheduler) = self.scheduler() {
            scheduler.enter();
        }
        Participant::of(self)
    }

    /// Starts a thread that takes part from now on.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn spawn<T: Send + 'static>(
        &self,
        name: &str,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> io::Result<JoinHandle<T>> {
        let expected = Expected::of(self);
        let ended = Arc::new(Waitable::new(self, false));
        let end = SetAtEnd(Arc::clone(&ended));
        let thread = thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || {
                let _part = expected.arrive();
                let _end = end;
                work()
            })?;
        Ok(JoinHandle { thread, ended })
    }

    /// Runs `body`, which may start threads that borrow from around it, and waits on the clock for
    /// their ends.
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

    /// Runs `wait`, which waits for something outside: on a virtual clock, time goes on without
    /// this thread meanwhile.
    pub fn away<T>(&self, wait: impl FnOnce() -> T) -> T {
        let _back = self.scheduler().and_then(|scheduler| {
            let depth = scheduler.go_away()?;
            Some(ComeBack { clock: self, depth })
        });
        wait()
    }
}

impl<'scope> Scope<'scope, '_> {
    /// Starts a thread that takes part from now on.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn spawn<T: Send + 'scope>(
        &self,
        name: &str,
        work: impl FnOnce() -> T + Send + 'scope,
    ) -> io::Result<ScopedJoinHandle<'scope, T>> {
        let expected = Expected::of(&self.clock);
        let ended = Arc::new(Waitable::new(&self.clock, false));
        *self.open.lock() += 1;
        let count = CountDown(Arc::clone(&self.open));
        let end = SetAtEnd(Arc::clone(&ended));
        let thread =
            thread::Builder::new()
                .name(name.to_owned())
                .spawn_scoped(self.scope, move || {
                    let _part = expected.arrive();
                    let (_count, _end) = (count, end);
                    work()
                })?;
        Ok(ScopedJoinHandle { thread, ended })
    }
}

/// A thread about to start: counts as running, and no more where it does not start after all.
struct Expected(Option<Clock>);

impl Expected {
    fn of(clock: &Clock) -> Self {
        if let Some(scheduler) = clock.scheduler() {
            scheduler.expect();
        }
        Self(Some(clock.clone()))
    }

    /// This thread is the one: it takes part.
    fn arrive(mut self) -> Option<Participant> {
        let clock = self.0.take()?;
        if let Some(scheduler) = clock.scheduler() {
            scheduler.arrive();
        }
        Some(Participant::of(&clock))
    }
}

impl Drop for Expected {
    fn drop(&mut self) {
        if let Some(scheduler) = self.0.as_ref().and_then(Clock::scheduler) {
            scheduler.expect_no_more();
        }
    }
}

/// Tells that the thread has ended, also by a panic.
struct SetAtEnd(Arc<Waitable<bool>>);

impl Drop for SetAtEnd {
    fn drop(&mut self) {
        self.0.update(|ended| *ended = true);
    }
}

/// Counts a scope's thread as ended.
struct CountDown(Arc<Waitable<usize>>);

impl Drop for CountDown {
    fn drop(&mut self) {
        self.0.update(|open| *open -= 1);
    }
}

/// Waits for a scope's threads, also when its body panics.
struct WaitForAll(Arc<Waitable<usize>>);

impl Drop for WaitForAll {
    fn drop(&mut self) {
        self.0.wait(|open| (*open == 0).then_some(()));
    }
}

/// Ends [`Clock::away`].
struct ComeBack<'a> {
    clock: &'a Clock,
    depth: usize,
}

impl Drop for ComeBack<'_> {
    fn drop(&mut self) {
        if let Some(scheduler) = self.clock.scheduler() {
            scheduler.come_back(self.depth);
        }
    }
}
