//! The watchdog, and why the chip started.
//!
//! The watchdog works in two stages. Its first time-out is an interrupt that stops the motor and
//! leaves a mark in memory; the second one resets the chip. The mark is what tells a hung program
//! from a pressed button for sure: the reset flags (MCUSR) come here through a boot loader. Uno's
//! first Optiboot (4.4) clears them; newer ones hand them on in r2 and use the watchdog themselves
//! to leave, so that a host that opens the port shows as external *and* watchdog.
//!
//! Before `main`, in section `.init3`, the flags are kept and cleared and the watchdog is turned
//! off: after its own reset it continues with its shortest time, 16 ms.

use core::arch::{asm, global_asm};
use core::{hint, ptr};

use rig_firmware::board::ResetCause;

use crate::clock;
use crate::masked::Masked;
use crate::pins;
use crate::registers::{BORF, EXTRF, PORF, WDCE, WDE, WDIE, WDRF};

/// Time-out of 0.5 s (WDP = 0101).
const HALF_SECOND: u8 = 0b101;

/// The mark of a program that hung or gave up. Memory is random after power-on.
const FAILED: u16 = 0x5AC3;

// r1 is zero and the stack stands here; nothing else has run yet. The three variables lie where
// the start-up code clears nothing.
global_asm!(
    ".section .noinit,\"aw\",@nobits",
    ".global relit_reset_flags",
    "relit_reset_flags: .zero 1",
    ".global relit_loader_flags",
    "relit_loader_flags: .zero 1",
    ".global relit_failed",
    "relit_failed: .zero 2",
    ".section .init3,\"ax\",@progbits",
    "in r24, 0x34",
    "sts relit_reset_flags, r24",
    "sts relit_loader_flags, r2",
    "out 0x34, r1",
    "wdr",
    "ldi r24, {unlock}",
    "sts 0x60, r24",
    "sts 0x60, r1",
    ".text",
    unlock = const WDCE | WDE,
);

unsafe extern "C" {
    static relit_reset_flags: u8;
    static relit_loader_flags: u8;
    static mut relit_failed: u16;
}

/// Tells why the chip started, and takes the mark away: to be asked once.
pub(crate) fn reset_cause() -> ResetCause {
    // SAFETY: these variables are above; an interrupt touches the mark only to end the program.
    let (own, loader, failed) = unsafe {
        let failed = ptr::read_volatile(&raw const relit_failed);
        ptr::write_volatile(&raw mut relit_failed, 0);
        (relit_reset_flags, relit_loader_flags, failed)
    };
    // Without a boot loader r2 is anything; flags are four bits.
    let flags = if own != 0 || loader > 0x0F {
        own
    } else {
        loader
    };
    if flags & PORF != 0 {
        ResetCause::PowerOn
    } else if flags & BORF != 0 {
        ResetCause::BrownOut
    } else if failed == FAILED || flags & (WDRF | EXTRF) == WDRF {
        ResetCause::Watchdog
    } else {
        ResetCause::External
    }
}

/// Sets the watchdog up; its new time begins here.
fn set(control: u8) {
    // SAFETY: the timed sequence that the data sheet demands, on a register that only this
    // function writes.
    unsafe {
        asm!("wdr", "sts 0x60, {unlock}", "sts 0x60, {control}", "wdr",
            unlock = in(reg_upper) WDCE | WDE, control = in(reg_upper) control);
    }
}

/// Starts the watchdog; to be called with interrupts off.
pub(crate) fn start() {
    set(WDIE | WDE | HALF_SECOND);
}

/// Gives the program another half second.
pub(crate) fn pet() {
    // SAFETY: resets the watchdog's counter, no memory is touched.
    unsafe { asm!("wdr") };
}

/// Ends a program that cannot go on: no steps, no current, and a reset in 16 ms.
pub(crate) fn fail() -> ! {
    // SAFETY: turns interrupts off, for good.
    unsafe { asm!("cli") };
    // SAFETY: interrupts stay off, and whatever held a proof before never runs again.
    let mut masked = unsafe { Masked::in_interrupt() };
    clock::stop_for_good();
    pins::feed_driver(false, &mut masked);
    // SAFETY: the variable is above, and nothing runs beside this.
    unsafe { ptr::write_volatile(&raw mut relit_failed, FAILED) };
    set(WDE);
    loop {
        hint::spin_loop();
    }
}

/// First time-out of the watchdog: the main loop hangs.
#[unsafe(no_mangle)]
extern "avr-interrupt" fn __vector_6() {
    fail()
}
