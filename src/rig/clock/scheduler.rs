//! Virtual time: who takes part, who waits until when, and the jump to the next deadline.

use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::panic::Location;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, Thread, ThreadId};
use std::time::{Duration, Instant};

/// What a virtual clock shows when it is made: late enough that times before it are positive.
const START_US: i64 = 1_000_000_000;

/// Names something that can be waited for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct WaitId(u64);

impl WaitId {
    /// One that no other has.
    pub(super) fn unique() -> WaitId {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        WaitId(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

/// Names a wait that was announced and may have begun.
#[derive(Debug)]
pub(super) struct Ticket(u64);

/// How a wait ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ended {
    /// By its deadline or by a notification.
    Woken,
    /// Everybody waits for ever, and this thread is unwinding already.
    Abandoned,
}

/// A virtual clock.
pub(super) struct Scheduler {
    now_us: AtomicI64,
    pace: Option<Pace>,
    state: Mutex<State>,
}

/// The upper limit of how fast virtual time passes.
#[derive(Debug)]
struct Pace {
    started: Instant,
    factor: f64,
}

impl Pace {
    /// How long in real time until the clock may show `us`.
    fn left(&self, us: i64) -> Duration {
        let since_start = us.saturating_sub(START_US).max(0) as f64 / 1e6 / self.factor;
        let due = Duration::try_from_secs_f64(since_start).unwrap_or(Duration::MAX);
        due.saturating_sub(self.started.elapsed())
    }
}

#[derive(Default)]
struct State {
    /// The threads that take part, and how often each has said so.
    members: HashMap<ThreadId, usize>,
    /// Threads that take part and are in no wait, those about to start among them.
    running: usize,
    /// Threads that take part and wait for something outside.
    away: usize,
    waiters: BTreeMap<u64, Waiter>,
    next_ticket: u64,
    /// Who waits for whom, once nobody can go on any more.
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

    /// This thread takes part until it has left as often as it has entered.
    pub(super) fn enter(&self) {
        let mut state = self.lock();
        let depth = state.members.entry(thread::current().id()).or_default();
        *depth += 1;
        if *depth == 1 {
            state.running += 1;
        }
    }

    /// Takes back one [`Scheduler::enter`] or [`Scheduler::arrive`].
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

    /// A thread is about to start that takes part: no time passes until it does.
    pub(super) fn expect(&self) {
        self.lock().running += 1;
    }

    /// The thread that was expected is this one.
    pub(super) fn arrive(&self) {
        self.lock().members.insert(thread::current().id(), 1);
    }

    /// The thread that was expected does not come.
    pub(super) fn expect_no_more(&self) {
        let mut state = self.lock();
        state.running -= 1;
        self.advance(&mut state);
    }

    /// This thread does not take part for now; gives how often it had said that it does.
    pub(super) fn go_away(&self) -> Option<usize> {
        let mut state = self.lock();
        let depth = state.members.remove(&thread::current().id())?;
        state.running -= 1;
        state.away += 1;
        self.advance(&mut state);
        Some(depth)
    }

    /// Ends [`Scheduler::go_away`].
    pub(super) fn come_back(&self, depth: usize) {
        let mut state = self.lock();
        state.members.insert(thread::current().id(), depth);
        state.running += 1;
        state.away -= 1;
    }

    /// Announces a wait of this thread, which takes part: from now on nothing that it waits for is
    /// missed. `None` where the deadline is past.
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

    /// Waits as announced. Holds no lock of the caller's.
    pub(super) fn block(&self, ticket: Ticket) -> Ended {
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
        Ended::Woken
    }

    /// Wakes all who wait for `id`. They count as running before this returns.
    pub(super) fn notify(&self, id: WaitId) {
        self.lock().wake(|waiter| waiter.id == Some(id));
    }

    /// Where everybody waits, lets time go on to the next deadline, as far as the pace allows.
    fn advance(&self, state: &mut State) {
        if state.running > 0 || state.waiters.is_empty() || state.deadlock.is_some() {
            return;
        }
        let Some((first, deadline_us)) = state.first_deadline() else {
            if state.away == 0 {
                state.deadlock = Some(state.report());
                state.waiters.values().for_each(|waiter| {
                    waiter.wake.notify_one();
                });
            }
            return;
        };
        let left = self.pace.as_ref().map(|pace| pace.left(deadline_us));
        if left.is_none_or(|left| left.is_zero()) {
            self.now_us.store(deadline_us, Ordering::Release);
            state.wake(|waiter| waiter.deadline_us.is_some_and(|at| at <= deadline_us));
        } else if let Some(waiter) = state.waiters.get(&first) {
            // It looks at the real time itself.
            waiter.wake.notify_one();
        }
    }

    /// How long this waiter has to wait in real time before it lets the clock go on: it does so
    /// where its deadline is the next one.
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
    /// The waiter with the earliest deadline, of several the one that came first.
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
            "every thread on this virtual clock waits, and none for a time:".to_owned();
        for Waiter { thread, place, .. } in self.waiters.values() {
            let name = thread.name().unwrap_or("a thread without name");
            report += &format!(" {name} at {}:{};", place.file(), place.line());
        }
        report
    }
}

/// Tells a deadlock, unless the thread is about to end by another panic.
#[expect(
    clippy::panic,
    reason = "threads that wait for each other are a mistake in the program, and a wait has no other way to say so"
)]
fn give_up(report: String) -> Ended {
    if !thread::panicking() {
        panic!("{report}");
    }
    Ended::Abandoned
}

impl fmt::Debug for Scheduler {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Scheduler")
            .field("now_us", &self.now_us())
            .field("pace", &self.pace.as_ref().map(|pace| pace.factor))
            .finish_non_exhaustive()
    }
}
