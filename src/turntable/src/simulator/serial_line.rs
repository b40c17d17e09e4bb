//! One direction of the serial line: transmission times and faults.

use std::collections::VecDeque;

use rig_firmware::realtime::{Received, classify};

use super::faults::SerialFaults;

/// Transmission time of one byte, ticks: ten bits at 115 200 baud, in half microseconds.
pub(super) const BYTE_TICKS: u64 = 174;
/// Ticks per second.
const TICKS_PER_SECOND: f64 = 2e6;
/// Longest line that can be repeated, bytes.
const MAX_LINE_LENGTH: usize = 256;

/// A byte with the tick at which its transmission ends.
pub(super) type Timed = (u64, u8);

/// One direction of the serial line.
pub(super) struct SerialChannel {
    faults: SerialFaults,
    random: Random,
    /// The direction to the chip, in which real-time commands are not part of a line.
    to_chip: bool,
    /// The line so far, in case it is repeated.
    line: Vec<u8>,
    /// The first byte of a line end was lost: the second will be, too.
    losing_end: bool,
    /// When the transmission of the last byte ends.
    free_at: u64,
}

impl SerialChannel {
    pub(super) fn new(faults: SerialFaults, seed: u64, to_chip: bool) -> SerialChannel {
        SerialChannel {
            faults,
            random: Random(seed ^ (u64::from(to_chip) << 63)),
            to_chip,
            line: Vec::new(),
            losing_end: false,
            free_at: 0,
        }
    }

    /// Sends a byte at a tick; appends to `out` what arrives of it.
    pub(super) fn carry(&mut self, at: u64, byte: u8, out: &mut VecDeque<Timed>) {
        self.free_at = self.free_at.max(at.saturating_sub(BYTE_TICKS));
        if self.random.hits(self.faults.delay) {
            let late = self.faults.delay_by.as_secs_f64() * TICKS_PER_SECOND;
            self.free_at += late as u64;
        }
        if self.is_lost_end(byte) {
            return;
        }
        if self.random.hits(self.faults.drop) {
            self.free_at += BYTE_TICKS;
            return;
        }
        let mut arrived = byte;
        if self.random.hits(self.faults.flip) {
            arrived ^= 1 << (self.random.next() % 8);
        }
        self.pass(arrived, out);
        self.repeat_line(byte, arrived, out);
    }

    fn pass(&mut self, byte: u8, out: &mut VecDeque<Timed>) {
        self.free_at += BYTE_TICKS;
        out.push_back((self.free_at, byte));
    }

    /// Whether this byte belongs to a line end that is lost.
    fn is_lost_end(&mut self, byte: u8) -> bool {
        let losing = std::mem::take(&mut self.losing_end);
        if losing && byte == b'\n' {
            return true;
        }
        let lost = matches!(byte, b'\r' | b'\n') && self.random.hits(self.faults.merge);
        if lost {
            self.losing_end = byte == b'\r';
        }
        lost
    }

    /// Repeats a line after its line feed, if the fault occurs.
    fn repeat_line(&mut self, byte: u8, arrived: u8, out: &mut VecDeque<Timed>) {
        if self.to_chip && matches!(classify(byte), Received::Realtime(_)) {
            return;
        }
        self.line.push(arrived);
        if byte == b'\n' {
            let line = std::mem::take(&mut self.line);
            if self.random.hits(self.faults.duplicate) {
                line.iter().for_each(|&byte| self.pass(byte, out));
            }
        } else if self.line.len() >= MAX_LINE_LENGTH {
            self.line.clear();
        }
    }
}

/// A seeded generator of random numbers: G. L. Steele's SplitMix64 (OOPSLA 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    fn hits(&mut self, share: f64) -> bool {
        share > 0.0 && (self.next() >> 11) as f64 / (1_u64 << 53) as f64 <= share
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn carry(faults: SerialFaults, text: &[u8]) -> (Vec<u8>, VecDeque<Timed>) {
        let mut channel = SerialChannel::new(faults, 1, true);
        let mut out = VecDeque::new();
        text.iter()
            .for_each(|&byte| channel.carry(1000, byte, &mut out));
        (out.iter().map(|(_, byte)| *byte).collect(), out)
    }

    #[test]
    fn a_good_wire_carries_bytes_one_after_the_other() {
        let (bytes, timed) = carry(SerialFaults::default(), b"G0\n");
        assert_eq!(bytes, b"G0\n");
        let times: Vec<u64> = timed.iter().map(|(at, _)| *at).collect();
        assert_eq!(times, [1000, 1174, 1348]);
    }

    #[test]
    fn certain_faults_happen_to_all() {
        let none = SerialFaults::default();
        let (bytes, _) = carry(SerialFaults { drop: 1.0, ..none }, b"G0\nX");
        assert!(bytes.is_empty());
        let (bytes, _) = carry(SerialFaults { merge: 1.0, ..none }, b"A\r\nB\nC\r");
        assert_eq!(bytes, b"ABC");
        let twice = SerialFaults {
            duplicate: 1.0,
            ..none
        };
        let (bytes, _) = carry(twice, b"A?B\nC\n");
        assert_eq!(bytes, b"A?B\nAB\nC\nC\n");
        let (bytes, _) = carry(SerialFaults { flip: 1.0, ..none }, b"AAAA");
        assert!(bytes.iter().all(|byte| (byte ^ b'A').count_ones() == 1));
    }

    #[test]
    fn a_late_byte_keeps_the_order() {
        let late = SerialFaults {
            delay: 1.0,
            delay_by: Duration::from_millis(1),
            ..SerialFaults::default()
        };
        let (bytes, timed) = carry(late, b"AB");
        assert_eq!(bytes, b"AB");
        assert_eq!(timed[1].0 - timed[0].0, 2174);
    }

    #[test]
    fn shares_come_out_about_as_asked_and_a_seed_repeats_them() {
        let faults = SerialFaults {
            drop: 0.1,
            ..SerialFaults::default()
        };
        let text = vec![b'A'; 20_000];
        let first = carry(faults, &text).0;
        let lost = text.len() - first.len();
        assert!((1800..2200).contains(&lost), "{lost}");
        assert_eq!(carry(faults, &text).0, first);
    }
}
