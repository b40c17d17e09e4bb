//! Single bytes of the EEPROM.

use core::arch::asm;

use crate::masked::Foreground;
use crate::registers::{EEAR, EECR, EEDR, EEPE, EERE};

/// Waits for the end of a write: 3.4 ms.
fn wait() {
    while EECR.has(EEPE) {}
}

/// Reads a byte.
pub(crate) fn read(address: u16, foreground: &mut Foreground) -> u8 {
    wait();
    foreground.masked(|_| {
        EEAR.write(address);
        EECR.write(EERE);
        EEDR.read()
    })
}

/// Erases and writes a byte, and waits for the end of it, with interrupts on.
pub(crate) fn write(address: u16, byte: u8, foreground: &mut Foreground) {
    wait();
    foreground.masked(|_| {
        EEAR.write(address);
        EEDR.write(byte);
        EECR.write(0);
        // SAFETY: EEMPE, and within four cycles of it EEPE: no memory that Rust owns changes.
        unsafe { asm!("sbi 0x1f, 2", "sbi 0x1f, 1") };
    });
    wait();
}
