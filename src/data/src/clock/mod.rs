//! The clock of a capture: the time, and all waits.
//!
//! In a capture it is the system's monotonic clock in microseconds. Cameras stamp their frames with
//! it (V4L2 does so in the kernel), and the turntable's angles are fitted against it. It does not
//! follow changes of the time of day.
//!
//! A rehearsal or a test has no hardware to wait for and runs on *virtual time*
//! ([`Clock::virtual_time`], [`Clock::paced`]). A virtual clock stands still while any participating
//! thread runs. When all of them wait, it jumps to the earliest deadline. A thread that is waiting for
//! a processor or a disk counts as running, so that no deadline passes while it is kept from working,
//! however loaded the machine is. A turn of 50 s takes only as long as its computation.
//!
//! For this, every wait of a participating thread has to go through the clock:
//!
//! - [`Clock::sleep`] and [`Clock::sleep_until`] replace `thread::sleep`;
//! - a [`Waitable`] replaces a mutex with a condition variable, and the timeouts of channels;
//! - [`Clock::spawn`] and [`Clock::scope`] start participating threads and wait for their ends;
//! - a thread never waits while it holds a lock that another participant may want.
//!
//! If all participants wait and none of them has a deadline, every wait panics with a report of the
//! threads and the places where they wait. This includes a wait without deadline for a thread that
//! does not participate.
//!
//! On the monotonic clock these do the same as their counterparts in the standard library.
//!
//! ```
//! use relit_data::clock::{Clock, Waitable};
//! use std::sync::Arc;
//! use std::time::Duration;
//!
//! let clock = Clock::virtual_time();
//! // From here on, time passes only while this thread waits.
//! let _participant = clock.participate();
//! let gate = Arc::new(Waitable::new(&clock, false));
//! let opener = clock.spawn("opener", {
//!     let (clock, gate) = (clock.clone(), Arc::clone(&gate));
//!     move || {
//!         clock.sleep(Duration::from_secs(3600));
//!         gate.update(|open| *open = true);
//!     }
//! })?;
//!
//! let start_us = clock.now_us();
//! let in_time = gate.wait_for(Duration::from_secs(60), |open| open.then_some(()));
//! assert_eq!((in_time, clock.now_us() - start_us), (None, 60_000_000));
//! gate.wait(|open| open.then_some(()));
//! assert_eq!(clock.now_us() - start_us, 3_600_000_000);
//! opener.join().ok();
//! # Ok::<(), std::io::Error>(())
//! ```
//!
//! This module knows no other module.

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
pub use threads::{JoinHandle, Participant, Scope};
pub use waitable::Waitable;

/// A clock in microseconds, monotonic or virtual. Clones are the same clock.
#[derive(Debug, Clone)]
pub struct Clock {
    kind: Kind,
}

#[derive(Debug, Clone)]
enum Kind {
    Monotonic,
    Virtual(Arc<Scheduler>),
}

impl PartialEq for Clock {
    /// Whether both are the same clock.
    fn eq(&self, other: &Self) -> bool {
        match (&self.kind, &other.kind) {
            (Kind::Monotonic, Kind::Monotonic) => true,
            (Kind::Virtual(one), Kind::Virtual(other)) => Arc::ptr_eq(one, other),
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

    /// A new virtual clock that jumps to the next deadline without delay. All virtual clocks start at
    /// the same time.
    pub fn virtual_time() -> Clock {
        Clock {
            kind: Kind::Virtual(Arc::new(Scheduler::new(None))),
        }
    }

    /// A new virtual clock that runs at most `factor` times as fast as real time. On a machine that
    /// cannot keep up it falls behind, and catches up as soon as possible.
    ///
    /// A factor that is not a positive number counts as 1.
    pub fn paced(factor: f64) -> Clock {
        Clock {
            kind: Kind::Virtual(Arc::new(Scheduler::new(Some(usable(factor))))),
        }
    }

    /// The clock of a rehearsal, in which no device is real: a new virtual one, at most `times` as
    /// fast as real time, or where that is 0 as fast as possible.
    pub fn at_speed(times: f64) -> Clock {
        match times {
            0.0 => Self::virtual_time(),
            times => Self::paced(times),
        }
    }

    /// The time now, microseconds.
    pub fn now_us(&self) -> i64 {
        match &self.kind {
            Kind::Monotonic => monotonic_us(),
            Kind::Virtual(scheduler) => scheduler.now_us(),
        }
    }

    /// Waits for `duration` of this clock.
    #[track_caller]
    pub fn sleep(&self, duration: Duration) {
        self.sleep_until(self.after(duration));
    }

    /// Waits until the time `us`; returns at once if it has passed.
    #[track_caller]
    pub fn sleep_until(&self, us: i64) {
        match &self.kind {
            Kind::Monotonic => {
                let left = u64::try_from(us.saturating_sub(self.now_us())).unwrap_or(0);
                std::thread::sleep(Duration::from_micros(left));
            }
            Kind::Virtual(scheduler) => {
                let _participant = self.participate();
                if let Some(ticket) = scheduler.register(None, Some(us), Location::caller()) {
                    scheduler.block(ticket);
                }
            }
        }
    }

    /// The time of this clock after `duration` from now, microseconds.
    pub fn after(&self, duration: Duration) -> i64 {
        let us = i64::try_from(duration.as_micros()).unwrap_or(i64::MAX);
        self.now_us().saturating_add(us)
    }

    fn scheduler(&self) -> Option<&Arc<Scheduler>> {
        match &self.kind {
            Kind::Virtual(scheduler) => Some(scheduler),
            Kind::Monotonic => None,
        }
    }
}

fn usable(factor: f64) -> f64 {
    if factor.is_finite() && factor > 0.0 {
        factor
    } else {
        1.0
    }
}

fn monotonic_us() -> i64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec
        .saturating_mul(1_000_000)
        .saturating_add(now.tv_nsec / 1000)
}
