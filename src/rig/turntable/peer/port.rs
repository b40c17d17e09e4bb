use std::io;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::Peer;
use crate::clock::Clock;
use crate::turntable::port::Port;

/// The peer at the end of a port.
pub(in crate::turntable) struct PeerPort {
    pub(in crate::turntable) peer: Arc<Mutex<Peer>>,
    pub(in crate::turntable) clock: Clock,
}

impl Port for PeerPort {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        let until = std::time::Instant::now() + wait;
        loop {
            let mut peer = self.peer.lock().unwrap();
            peer.advance(self.clock.now_us());
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
            if std::time::Instant::now() >= until {
                return Ok(0);
            }
            std::thread::sleep(Duration::from_micros(100));
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
