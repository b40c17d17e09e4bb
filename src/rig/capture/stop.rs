//! A wish to stop that reaches a capture wherever it is, also where it waits for the table.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::time::Duration;

use crate::turntable::Table;

/// How often the wish is looked at while something waits for the table.
const LOOK: Duration = Duration::from_millis(20);

/// Who wanted the stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Stopped {
    /// A person.
    #[error("somebody asked for it")]
    Person,
    /// The program is to end.
    #[error("the program was told to end")]
    Shutdown,
}

/// A stop that may be asked for at any time; copies are the same wish.
#[derive(Debug, Clone, Default)]
pub struct StopRequest {
    wish: Arc<AtomicU8>,
}

impl StopRequest {
    /// Asks for a stop. That the program is to end outranks a person's wish.
    pub fn ask(&self, who: Stopped) {
        let rank = match who {
            Stopped::Person => 1,
            Stopped::Shutdown => 2,
        };
        self.wish.fetch_max(rank, Ordering::Relaxed);
    }

    /// Whether somebody asked.
    #[must_use]
    pub fn asked(&self) -> Option<Stopped> {
        match self.wish.load(Ordering::Relaxed) {
            0 => None,
            1 => Some(Stopped::Person),
            _ => Some(Stopped::Shutdown),
        }
    }

    /// Forgets a person's wish, which has been fulfilled. The end of the program stays asked for.
    pub fn forget(&self) {
        let person = Ordering::Relaxed;
        let _ = self.wish.compare_exchange(1, 0, person, person);
    }

    /// An error where somebody asked.
    ///
    /// # Errors
    /// [`Stopped`].
    pub fn check(&self) -> Result<(), Stopped> {
        self.asked().map_or(Ok(()), Err)
    }

    /// Runs `motion`, and stops the table as soon as somebody asks, so that what waits in there for
    /// the table comes back.
    pub fn over<T>(&self, table: &Table, motion: impl FnOnce() -> T) -> T {
        let over = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !over.load(Ordering::Relaxed) {
                    if self.asked().is_some() {
                        // What waits for the table tells what came of it.
                        let _ = table.stop();
                        return;
                    }
                    std::thread::sleep(LOOK);
                }
            });
            let _end = SetAtEnd(&over);
            motion()
        })
    }
}

/// Sets its flag however the block is left.
struct SetAtEnd<'a>(&'a AtomicBool);

impl Drop for SetAtEnd<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_of_the_program_outranks_a_person_and_is_not_forgotten() {
        let stop = StopRequest::default();
        assert_eq!(stop.check(), Ok(()));
        stop.ask(Stopped::Person);
        assert_eq!(stop.asked(), Some(Stopped::Person));
        stop.forget();
        assert_eq!(stop.asked(), None);
        let copy = stop.clone();
        copy.ask(Stopped::Shutdown);
        stop.ask(Stopped::Person);
        stop.forget();
        assert_eq!(stop.check(), Err(Stopped::Shutdown));
    }
}
