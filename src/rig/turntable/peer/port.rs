use std::io;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::{Peer, TICK_US};
use crate::clock::Clock;
use crate::turntable::port::Port;

/// The peer at the end of a port.
pub(in crate::turntable) struct PeerPort {
    pub(in crate::turntable) peer: Arc<Mutex<Peer>>,
    pub(in crate::turntable) clock: Clock,
}

impl Port for PeerPort {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        let deadline_us = self.clock.after(wait);
        loop {
            let now_us = self.clock.now_us();
            let mut peer = self.peer.lock().unwrap();
            peer.advance(now_us);
            let bytes = peer.give();
            drop(peer);
            if !bytes.is_empty() {
                assert!(
                    bytes.len() <= buffer.len(),
                    "the peer says too much at once"
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
        let mut peer = self.peer.lock().unwrap();
        peer.advance(self.clock.now_us());
        peer.take(bytes);
        Ok(())
    }

    fn name(&self) -> String {
        "the test's table".to_owned()
    }

    fn resets(&self) -> bool {
        false
    }
}
