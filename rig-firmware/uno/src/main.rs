//! The turntable's firmware on an Arduino Uno or Nano (ATmega328P at 16 MHz).
//!
//! The crate `rig-firmware` is the controller; this binary is the chip under it:
//!
//! | module | what it is for |
//! | --- | --- |
//! | `registers` | the chip's registers, by the data sheet's names |
//! | `masked` | data shared with interrupts |
//! | `common` | what several interrupts and the main loop work on |
//! | `pins` | step, direction, driver; index and emergency stop |
//! | `clock` | timer 1: microseconds, and the step interrupt |
//! | `serial` | the UART with its two buffers |
//! | `battery`, `eeprom` | one conversion, one byte |
//! | `watchdog` | the watchdog, and why the chip started |
//! | `uno` | all of it together as the core's `Board` |
//!
//! Interrupts never nest. The longest is the step interrupt; it has to end before two more bytes
//! have come in (170 us), which is what the UART can keep by itself.
#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

mod battery;
mod clock;
mod common;
mod eeprom;
mod masked;
mod pins;
mod registers;
mod serial;
mod uno;
mod watchdog;

use rig_firmware::controller::Controller;

use crate::masked::Foreground;
use crate::uno::Uno;

/// Where avr-libc's start-up code goes.
#[unsafe(no_mangle)]
extern "C" fn main() -> ! {
    // SAFETY: the start-up code calls `main` once, and nothing else makes one.
    let foreground = unsafe { Foreground::new() };
    let mut board = Uno::start(foreground);
    let mut controller = start(&mut board);
    run(&mut controller, &mut board)
}

// Functions of their own: in the frame of `main`, which holds the controller, most variables lie
// further off than one instruction reaches.

#[inline(never)]
fn start(board: &mut Uno) -> Controller {
    Controller::new(board)
}

#[inline(never)]
fn run(controller: &mut Controller, board: &mut Uno) -> ! {
    loop {
        controller.poll(board);
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    watchdog::fail()
}
