//! CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF, nothing reflected, nothing inverted.
//!
//! Guards checked lines and the settings in the EEPROM. Knows no other module.

/// A sum that grows byte by byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crc(u16);

impl Crc {
    /// The sum over no bytes.
    pub const fn new() -> Crc {
        Crc(0xFFFF)
    }

    /// Takes one more byte into the sum. Bit by bit: a table would cost a quarter of the chip's
    /// memory.
    pub fn update(&mut self, byte: u8) {
        let mut sum = self.0 ^ (u16::from(byte) << 8);
        for _ in 0..8 {
            let carry = sum & 0x8000 != 0;
            sum <<= 1;
            if carry {
                sum ^= 0x1021;
            }
        }
        self.0 = sum;
    }

    /// The sum so far.
    pub fn value(self) -> u16 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_check_value_comes_out() {
        let mut crc = Crc::new();
        b"123456789".iter().for_each(|&byte| crc.update(byte));
        assert_eq!(crc.value(), 0x29B1);
    }
}
