//! The one clock of a capture: what time it is, and every wait for a later one.
//!
//! Microseconds of the system's monotonic clock, with which cameras stamp their frames (V4L2 does so
//! in the kernel) and against which the turntable's angles are fitted. It does not follow changes of
//! the time of day.
//!
//! A rehearsal or a test has no hardware to wait for. It runs on *virtual time*
//! ([`Clock::virtual_time`], [`Clock::paced`]): a clock that stands still while any of the threads
//! that take part in it runs, and jumps to the earliest deadline once all of them wait. A thread
//! that the system keeps from running, or that waits for a disk, counts as running: no deadline
//! can pass it by, however loaded the machine is. A turn of 50 s takes as long as its work does.
//!
//! This needs every wait to go through the clock:
//!
//! - [`Clock::sleep`] and [`Clock::sleep_until`] in place of `thread::sleep`;
//! - a [`Waitable`] in place of a mutex with a condition variable, or of a channel's `recv_timeout`;
//! - [`Clock::spawn`] or [`Clock::scope`] for threads that take part, whose ends are waited for on
//!   the clock too;
//! - [`Clock::away`] around a wait for something outside that no thread of this clock brings about;
//! - and no lock is held over a wait.
//!
//! On the monotonic clock all of these are what the standard library offers.
//!
//! ```
//! use relit_rig::clock::{Clock, Waitable};
//! use std::sync::Arc;
//! use std::time::Duration;
//!
//! let clock = Clock::virtual_time();
//! // From here on, time passes only while this thread waits.
//! let _part = clock.take_part();
//! let door = Arc::new(Waitable::new(&clock, false));
//! let opener = clock.spawn("opener", {
//!     let (clock, door) = (clock.clone(), Arc::clone(&door));
//!     move || {
//!         clock.sleep(Duration::from_secs(3600));
//!         door.update(|open| *open = true);
//!     }
//! })?;
//!
//! let start_us = clock.now_us();
//! let in_time = door.wait_for(Duration::from_secs(60), |open| open.then_some(()));
//! assert_eq!((in_time, clock.now_us() - start_us), (None, 60_000_000));
//! door.wait(|open| open.then_some(()));
//! assert_eq!(clock.now_us() - start_us, 3_600_000_000);
//! opener.join().ok();
//! # Ok::<(), std::io::Error>(())
//! ```
//!
//! This module knows no other.

mod scheduler;
#[cfg(test)]
mod tests;
mod threads;
mod waitable;

use std::panic::Location;
use std::sync::Arc;
use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

use scheduler::Scheduler;
pub use threads::{JoinHandle, Participant, Scope, ScopedJoinHandle};
pub use waitable::Waitable;

/// Microseconds, and the waits for them: real, or virtual. Clones are the same clock.
#[derive(Debug, Clone)]
pub struct Clock {
    kind: Kind,
}

#[derive(Debug, Clone)]
enum Kind {
    Monotonic,
    Scaled { start_us: i64, factor: f64 },
    Virtual(Arc<Scheduler>),
}

impl PartialEq for Clock {
    /// Whether both are the same clock.
    fn eq(&self, other: &Self) -> bool {
        match (&self.kind, &other.kind) {
            (Kind::Monotonic, Kind::Monotonic) => true,
            (Kind::Virtual(one), Kind::Virtual(other)) => Arc::ptr_eq(one, other),
            (
                Kind::Scaled { start_us, factor },
                Kind::Scaled {
                    start_us: start,
                    factor: times,
                },
            ) => start_us == start && factor == times,
            _ => false,
        }
    }
}

impl Clock {
    /// The system's monotonic clock: comparable with the kernel's time stamps.
    pub fn monotonic() -> Clock {
        Clock {
            kind: Kind::Monotonic,
        }
    }

    /// A virtual clock of its own, which jumps from deadline to deadline without delay. It starts
    /// at the same time whenever it is made.
    pub fn virtual_time() -> Clock {
        Clock {
            kind: Kind::Virtual(Arc::new(Scheduler::new(None))),
        }
    }

    /// A virtual clock that runs at most `factor` times as fast as real time: where the machine
    /// cannot keep up, it falls behind, and catches up as soon as it can.
    ///
    /// A factor that is not a positive number counts as 1.
    pub fn paced(factor: f64) -> Clock {
        Clock {
            kind: Kind::Virtual(Arc::new(Scheduler::new(Some(usable(factor))))),
        }
    }

    /// A clock that agrees with the monotonic one now and runs `factor` times as fast from here,
    /// whoever runs or waits.
    ///
    /// A factor that is not a positive number counts as 1.
    pub fn scaled(factor: f64) -> Clock {
        Clock {
            kind: Kind::Scaled {
                start_us: monotonic_us(),
                factor: usable(factor),
            },
        }
    }

    /// How many times faster than real time this clock runs whoever waits: 1 but for a
    /// [scaled](Clock::scaled) one.
    pub fn factor(&self) -> f64 {
        match self.kind {
            Kind::Scaled { factor, .. } => factor,
            Kind::Monotonic | Kind::Virtual(_) => 1.0,
        }
    }

    /// Microseconds now.
    pub fn now_us(&self) -> i64 {
        match &self.kind {
            Kind::Monotonic => monotonic_us(),
            Kind::Scaled { start_us, factor } => {
                let since_start = monotonic_us().saturating_sub(*start_us) as f64;
                start_us.saturating_add((since_start * factor) as i64)
            }
            Kind::Virtual(scheduler) => scheduler.now_us(),
        }
    }

    /// How long to wait in real time until this clock has gone on by `own`.
    pub fn real(&self, own: Duration) -> Duration {
        own.div_f64(self.factor().max(f64::MIN_POSITIVE))
    }

    /// Waits until this clock has gone on by `duration`.
    #[track_caller]
    pub fn sleep(&self, duration: Duration) {
        self.sleep_until(self.after(duration));
    }

    /// Waits until this clock shows `us`; not at all where it does so already.
    #[track_caller]
    pub fn sleep_until(&self, us: i64) {
        match &self.kind {
            Kind::Monotonic | Kind::Scaled { .. } => {
                let left = u64::try_from(us.saturating_sub(self.now_us())).unwrap_or(0);
                std::thread::sleep(self.real(Duration::from_micros(left)));
            }
            Kind::Virtual(scheduler) => {
                let _part = self.take_part();
                if let Some(ticket) = scheduler.register(None, Some(us), Location::caller()) {
                    scheduler.block(ticket);
                }
            }
        }
    }

    /// What this clock will show in so long, microseconds.
    pub fn after(&self, duration: Duration) -> i64 {
        let us = i64::try_from(duration.as_micros()).unwrap_or(i64::MAX);
        self.now_us().saturating_add(us)
    }

    fn scheduler(&self) -> Option<&Arc<Scheduler>> {
        match &self.kind {
            Kind::Virtual(scheduler) => Some(scheduler),
            Kind::Monotonic | Kind::Scaled { .. } => None,
        }
    }
}

fn usable(factor: f64) -> f64 {
    match factor.is_finite() && factor > 0.0 {
        true => factor,
        false => 1.0,
    }
}

fn monotonic_us() -> i64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec
        .saturating_mul(1_000_000)
        .saturating_add(now.tv_nsec / 1000)
}
