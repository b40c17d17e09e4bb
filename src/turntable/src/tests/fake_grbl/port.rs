use std::io;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::{FakeGrbl, TICK_US};
use crate::port::Port;
use relit_data::clock::Clock;

/// A port to the fake controller.
pub(crate) struct FakePort {
    pub(crate) fake_grbl: Arc<Mutex<FakeGrbl>>,
    pub(crate) clock: Clock,
}

impl Port for FakePort {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        let deadline_us = self.clock.after(wait);
        loop {
            let now_us = self.clock.now_us();
            let mut fake_grbl = self.fake_grbl.lock().unwrap();
            fake_grbl.advance(now_us);
            let bytes = fake_grbl.give();
            drop(fake_grbl);
            if !bytes.is_empty() {
                assert!(
                    bytes.len() <= buffer.len(),
                    "the controller sends too much at once"
                );
                buffer[..bytes.len()].copy_from_slice(&bytes);
                return Ok(bytes.len());
            }
            if now_us >= deadline_us {
                return Ok(0);
            }
            self.clock.sleep_until(deadline_us.min(now_us + TICK_US));
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut fake_grbl = self.fake_grbl.lock().unwrap();
        fake_grbl.advance(self.clock.now_us());
        fake_grbl.take(bytes);
        Ok(())
    }

    fn name(&self) -> String {
        "the test's table".to_owned()
    }

    fn resets(&self) -> bool {
        false
    }
}
