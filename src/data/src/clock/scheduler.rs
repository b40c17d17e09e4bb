//! Virtual time: the participating threads, their waits, and the jumps to the next deadline.

use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::panic::Location;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, Thread, ThreadId};
use std::time::{Duration, Instant};

/// Start time of a virtual clock, microseconds; large enough that earlier times are positive.
const START_US: i64 = 1_000_000_000;

/// Identifies something that threads wait for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct WaitId(u64);

impl WaitId {
    /// A new id, different from all others.
    pub(super) fn unique() -> WaitId {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        WaitId(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

/// Identifies a registered wait.
#[derive(Debug)]
pub(super) struct Ticket(u64);

/// How a wait ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum WaitOutcome {
    /// The deadline has come, or a notification.
    Woken,
    /// There is a deadlock, and this thread is already unwinding.
    Abandoned,
}

/// A virtual clock.
pub(super) struct Scheduler {
    now_us: AtomicI64,
    pace: Option<Pace>,
    state: Mutex<State>,
}

/// The upper limit of the speed of virtual time.
#[derive(Debug)]
struct Pace {
    started: Instant,
    factor: f64,
}

impl Pace {
    /// Real time until the clock may reach `us`.
    fn left(&self, us: i64) -> Duration {
        let since_start = us.saturating_sub(START_US).max(0) as f64 / 1e6 / self.factor;
        let due = Duration::try_from_secs_f64(since_start).unwrap_or(Duration::MAX);
        due.saturating_sub(self.started.elapsed())
    }
}

#[derive(Default)]
struct State {
    /// The participating threads, with the number of their open [`Scheduler::enter`].
    members: HashMap<ThreadId, usize>,
    /// Number of participants that are not in a wait, including threads about to start.
    running: usize,
    waiters: BTreeMap<u64, Waiter>,
    next_ticket: u64,
    /// The report of a deadlock, once there is one.
    deadlock: Option<String>,
}

struct Waiter {
    deadline_us: Option<i64>,
    id: Option<WaitId>,
    wake: Arc<Condvar>,
    thread: Thread,
    place: &'static Location<'static>,
}

impl Scheduler {
    pub(super) fn new(factor: Option<f64>) -> Self {
        Self {
            now_us: AtomicI64::new(START_US),
            pace: factor.map(|factor| Pace {
                started: Instant::now(),
                factor,
            }),
            state: Mutex::default(),
        }
    }

    pub(super) fn now_us(&self) -> i64 {
        self.now_us.load(Ordering::Acquire)
    }

    /// Makes this thread a participant, until it has called [`Scheduler::leave`] as many times.
    pub(super) fn enter(&self) {
        let mut state = self.lock();
        let depth = state.members.entry(thread::current().id()).or_default();
        *depth += 1;
        if *depth == 1 {
            state.running += 1;
        }
    }

    /// Ends one [`Scheduler::enter`] or [`Scheduler::arrive`].
    pub(super) fn leave(&self) {
        let mut state = self.lock();
        let id = thread::current().id();
        let Some(depth) = state.members.get_mut(&id) else {
            return;
        };
        *depth -= 1;
        if *depth == 0 {
            state.members.remove(&id);
            state.running -= 1;
            self.advance(&mut state);
        }
    }

    /// Announces a new participating thread: no time passes until it has started.
    pub(super) fn expect(&self) {
        self.lock().running += 1;
    }

    /// Makes this thread the participant that was announced.
    pub(super) fn arrive(&self) {
        self.lock().members.insert(thread::current().id(), 1);
    }

    /// Withdraws the announcement of a thread.
    pub(super) fn expect_no_more(&self) {
        let mut state = self.lock();
        state.running -= 1;
        self.advance(&mut state);
    }

    /// Registers a wait of this participating thread: no notification after this call is missed.
    /// `None` if the deadline has passed.
    pub(super) fn register(
        &self,
        id: Option<WaitId>,
        deadline_us: Option<i64>,
        place: &'static Location<'static>,
    ) -> Option<Ticket> {
        if deadline_us.is_some_and(|deadline_us| deadline_us <= self.now_us()) {
            return None;
        }
        let mut state = self.lock();
        let ticket = state.next_ticket;
        state.next_ticket += 1;
        let waiter = Waiter {
            deadline_us,
            id,
            wake: Arc::default(),
            thread: thread::current(),
            place,
        };
        state.waiters.insert(ticket, waiter);
        Some(Ticket(ticket))
    }

    /// Performs a registered wait. The caller must hold no lock.
    pub(super) fn block(&self, ticket: Ticket) -> WaitOutcome {
        let Ticket(ticket) = ticket;
        let mut state = self.lock();
        state.running -= 1;
        self.advance(&mut state);
        while let Some(waiter) = state.waiters.get(&ticket) {
            let wake = Arc::clone(&waiter.wake);
            if let Some(report) = state.deadlock.clone() {
                state.waiters.remove(&ticket);
                state.running += 1;
                drop(state);
                return give_up(report);
            }
            state = match self.left(&state, ticket) {
                Some(left) => {
                    let woken = wake.wait_timeout(state, left);
                    woken.unwrap_or_else(PoisonError::into_inner).0
                }
                None => wake.wait(state).unwrap_or_else(PoisonError::into_inner),
            };
            self.advance(&mut state);
        }
        WaitOutcome::Woken
    }

    /// Wakes all threads that wait for `id`. When this returns, they count as running.
    pub(super) fn notify(&self, id: WaitId) {
        self.lock().wake(|waiter| waiter.id == Some(id));
    }

    /// If all participants wait, advances the time to the next deadline, as far as the pace allows.
    fn advance(&self, state: &mut State) {
        if state.running > 0 || state.waiters.is_empty() || state.deadlock.is_some() {
            return;
        }
        let Some((first, deadline_us)) = state.first_deadline() else {
            state.deadlock = Some(state.report());
            state.waiters.values().for_each(|waiter| {
                waiter.wake.notify_one();
            });
            return;
        };
        let left = self.pace.as_ref().map(|pace| pace.left(deadline_us));
        if left.is_none_or(|left| left.is_zero()) {
            self.now_us.store(deadline_us, Ordering::Release);
            state.wake(|waiter| waiter.deadline_us.is_some_and(|at| at <= deadline_us));
        } else if let Some(waiter) = state.waiters.get(&first) {
            // That thread waits for the rest of the real time.
            waiter.wake.notify_one();
        }
    }

    /// Real time that this waiter has to wait before it advances the clock; `None` if that is another
    /// thread's task.
    fn left(&self, state: &State, ticket: u64) -> Option<Duration> {
        let pace = self.pace.as_ref().filter(|_| state.running == 0)?;
        let (first, deadline_us) = state.first_deadline()?;
        (first == ticket).then(|| pace.left(deadline_us))
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// The waiter with the earliest deadline; among equal ones, the first.
    fn first_deadline(&self) -> Option<(u64, i64)> {
        let deadlines = self
            .waiters
            .iter()
            .filter_map(|(ticket, waiter)| Some((*ticket, waiter.deadline_us?)));
        deadlines.min_by_key(|(ticket, deadline_us)| (*deadline_us, *ticket))
    }

    fn wake(&mut self, which: impl Fn(&Waiter) -> bool) {
        for (_, waiter) in self.waiters.extract_if(.., |_, waiter| which(waiter)) {
            self.running += 1;
            waiter.wake.notify_one();
        }
    }

    fn report(&self) -> String {
        let mut report =
            "deadlock: every thread on this virtual clock waits, and none has a deadline:"
                .to_owned();
        for Waiter { thread, place, .. } in self.waiters.values() {
            let name = thread.name().unwrap_or("unnamed thread");
            report += &format!(" {name} at {}:{};", place.file(), place.line());
        }
        report
    }
}

/// Panics because of a deadlock, unless the thread is already unwinding.
#[expect(
    clippy::panic,
    reason = "a deadlock is an error in the program, and a wait cannot return it"
)]
fn give_up(report: String) -> WaitOutcome {
    if !thread::panicking() {
        panic!("{report}");
    }
    WaitOutcome::Abandoned
}

impl fmt::Debug for Scheduler {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Scheduler")
            .field("now_us", &self.now_us())
            .field("pace", &self.pace.as_ref().map(|pace| pace.factor))
            .finish_non_exhaustive()
    }
}
