//! The lease: a moving table stops when its host has been silent for too long.

use super::{Alarm, Controller, Stop};
use crate::board::Board;
use crate::settings::Key;

impl Controller {
    /// Stops a moving table whose host has fallen silent.
    pub(super) fn watch_lease<B: Board>(&mut self, board: &mut B) {
        let lease = self.settings.amount(Key::Lease).saturating_mul(1_000_000);
        let (moving, now) = board.with_stepper(|stepper, now| (stepper.is_moving(), now));
        if !moving {
            self.heard = now;
        } else if lease > 0 && now.wrapping_sub(self.heard) >= lease && self.stopping.is_none() {
            self.stop(board, Stop::Alarm(Alarm::LeaseExpired));
        }
    }
}
