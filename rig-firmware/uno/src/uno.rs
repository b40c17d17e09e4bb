//! The chip as the core's [`Board`].

use rig_firmware::board::{Board, Events, Inputs, Outputs, ResetCause};
use rig_firmware::stepper::Stepper;

use crate::clock;
use crate::common::{EVENTS, STEPPER};
use crate::masked::Foreground;
use crate::serial;
use crate::{battery, eeprom, pins, watchdog};

/// An Arduino Uno or Nano with the CNC shield.
///
/// It holds nothing: what the chip's peripherals need lies with them. So no register and no code
/// is spent on handing it round.
pub(crate) struct Uno {
    foreground: Foreground,
}

impl Uno {
    /// Sets the chip up: driver released, watchdog running, interrupts on.
    pub(crate) fn start(mut foreground: Foreground) -> Uno {
        pins::start();
        watchdog::start();
        clock::start();
        serial::start();
        battery::start();
        foreground.enable_interrupts();
        Uno { foreground }
    }
}

impl Board for Uno {
    fn with_stepper<R>(&mut self, f: impl FnOnce(&mut Stepper, u32) -> R) -> R {
        self.foreground.masked(|masked| {
            let micros = clock::micros(masked);
            f(STEPPER.lend(masked), micros)
        })
    }

    fn start_steps(&mut self) {
        self.foreground.masked(clock::start_steps);
    }

    fn micros(&mut self) -> u32 {
        self.foreground.masked(clock::micros)
    }

    fn receive(&mut self) -> Option<u8> {
        self.foreground.masked(serial::receive)
    }

    fn receive_room(&mut self) -> u8 {
        self.foreground.masked(serial::receive_room)
    }

    fn take_events(&mut self) -> Events {
        self.foreground.masked(|masked| EVENTS.lend(masked).take())
    }

    fn send(&mut self, byte: u8) {
        while !self.foreground.masked(|masked| serial::send(byte, masked)) {}
    }

    fn enable_driver(&mut self, enabled: bool) {
        self.foreground
            .masked(|masked| pins::feed_driver(enabled, masked));
    }

    fn configure_outputs(&mut self, outputs: Outputs) {
        self.foreground
            .masked(|masked| pins::configure(outputs, masked));
    }

    fn inputs(&mut self) -> Inputs {
        pins::inputs()
    }

    fn battery(&mut self) -> u16 {
        self.foreground.masked(battery::read)
    }

    fn eeprom_read(&mut self, address: u16) -> u8 {
        eeprom::read(address, &mut self.foreground)
    }

    fn eeprom_write(&mut self, address: u16, byte: u8) {
        // A record of settings has enough bytes to take longer than the watchdog waits.
        watchdog::pet();
        eeprom::write(address, byte, &mut self.foreground);
    }

    fn pet_watchdog(&mut self) {
        watchdog::pet();
    }

    fn reset_cause(&mut self) -> ResetCause {
        watchdog::reset_cause()
    }
}
