//! The main loop's part of the firmware.

use crate::board::Board;

/// The controller: protocol, states and plans.
#[derive(Debug)]
pub struct Controller {
    started_us: u32,
}

impl Controller {
    /// Reads the settings and sends the banner.
    pub fn new(board: &mut impl Board) -> Controller {
        Controller {
            started_us: board.micros(),
        }
    }

    /// One round of the main loop; never waits longer than it takes to send what it has to say.
    pub fn poll(&mut self, board: &mut impl Board) {
        board.pet_watchdog();
        let events = board.take_events();
        if events.contains(crate::board::Events::STATUS) {
            board.send(b'<');
        }
        let _ = self.started_us;
    }
}
