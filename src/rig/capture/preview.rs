//! The newest frame for whoever wants to look: any number of viewers, none of whom the recorder
//! ever waits for.

use std::sync::{Arc, Condvar, Mutex, PoisonError, TryLockError};
use std::time::{Duration, Instant};

use crate::camera::Frame;

/// The camera's newest frame.
#[derive(Debug, Default)]
pub struct Preview {
    newest: Mutex<Newest>,
    came: Condvar,
}

#[derive(Debug, Default)]
struct Newest {
    number: u64,
    frame: Option<Arc<Frame>>,
    ended: bool,
}

impl Preview {
    /// Puts a frame in place of the one before. Where a viewer is just taking that one, the frame
    /// is passed over: the next one comes soon.
    pub(super) fn publish(&self, frame: &Arc<Frame>) {
        let mut newest = match self.newest.try_lock() {
            Ok(newest) => newest,
            Err(TryLockError::Poisoned(newest)) => newest.into_inner(),
            Err(TryLockError::WouldBlock) => return,
        };
        newest.number += 1;
        newest.frame = Some(Arc::clone(frame));
        drop(newest);
        self.came.notify_all();
    }

    /// Tells viewers that no more frames come.
    pub(super) fn end(&self) {
        let mut newest = self.newest.lock().unwrap_or_else(PoisonError::into_inner);
        newest.ended = true;
        drop(newest);
        self.came.notify_all();
    }

    /// The newest frame with its number, once it is newer than frame `seen` (0: any); `None` where
    /// none came within `timeout`, or none will come any more.
    #[must_use]
    pub fn newer_than(&self, seen: u64, timeout: Duration) -> Option<(u64, Arc<Frame>)> {
        let until = Instant::now() + timeout;
        let mut newest = self.newest.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if newest.number > seen {
                let number = newest.number;
                return newest.frame.clone().map(|frame| (number, frame));
            }
            let left = until.saturating_duration_since(Instant::now());
            if newest.ended || left.is_zero() {
                return None;
            }
            let waited = self.came.wait_timeout(newest, left);
            newest = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;
    use crate::capture::tests::frame;

    #[test]
    fn a_viewer_gets_the_newest_frame_once() {
        let preview = Preview::default();
        assert!(preview.newer_than(0, Duration::ZERO).is_none());
        (0..3).for_each(|n| preview.publish(&Arc::new(frame(n))));
        let (number, newest) = preview.newer_than(0, Duration::ZERO).unwrap();
        assert_eq!((number, newest.t_us), (3, frame(2).t_us));
        assert!(
            preview
                .newer_than(number, Duration::from_millis(1))
                .is_none()
        );
    }

    #[test]
    fn a_viewer_that_waits_is_woken_by_a_frame_and_by_the_end() {
        let preview = Preview::default();
        thread::scope(|scope| {
            let viewer = scope.spawn(|| {
                let mut seen = 0;
                while let Some((number, _)) = preview.newer_than(seen, Duration::from_secs(60)) {
                    seen = number;
                }
                seen
            });
            (0..50).for_each(|n| preview.publish(&Arc::new(frame(n))));
            preview.end();
            assert!(viewer.join().unwrap() > 0);
        });
    }

    #[test]
    fn a_viewer_that_holds_the_slot_does_not_hold_up_the_recorder() {
        let preview = Preview::default();
        preview.publish(&Arc::new(frame(0)));
        let held = preview.newest.lock().unwrap();
        preview.publish(&Arc::new(frame(1)));
        assert_eq!(held.number, 1);
    }
}
