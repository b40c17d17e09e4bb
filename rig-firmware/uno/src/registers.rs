//! The registers that this firmware uses, by the names and bits of the ATmega328P's data sheet
//! (DS40002061).
//!
//! Plain addresses: a generated crate for all of the chip would bring a hundred others into the
//! build for these.

use core::ptr;

/// A register of eight bits.
#[derive(Clone, Copy)]
pub(crate) struct Register(usize);

impl Register {
    /// Reads it.
    pub(crate) fn read(self) -> u8 {
        // SAFETY: only this module makes registers, and each address below is one of the chip.
        unsafe { ptr::read_volatile(self.0 as *const u8) }
    }

    /// Writes it.
    pub(crate) fn write(self, value: u8) {
        // SAFETY: as in `read`; none of these registers moves memory that Rust owns.
        unsafe { ptr::write_volatile(self.0 as *mut u8, value) }
    }

    /// Whether any of `bits` is set.
    pub(crate) fn has(self, bits: u8) -> bool {
        self.read() & bits != 0
    }

    /// Sets or clears `bits` and leaves the others. Not atomic: where an interrupt writes the
    /// register too, interrupts have to be masked.
    pub(crate) fn change(self, bits: u8, set: bool) {
        if set {
            self.write(self.read() | bits);
        } else {
            self.write(self.read() & !bits);
        }
    }
}

/// A register of sixteen bits: two bytes that the chip keeps together through one temporary
/// byte, so interrupts have to be masked around each use.
#[derive(Clone, Copy)]
pub(crate) struct WideRegister {
    low: Register,
    high: Register,
}

impl WideRegister {
    const fn at(address: usize) -> WideRegister {
        WideRegister {
            low: Register(address),
            high: Register(address + 1),
        }
    }

    /// Reads the low byte first, which latches the high one.
    pub(crate) fn read(self) -> u16 {
        let low = self.low.read();
        u16::from_le_bytes([low, self.high.read()])
    }

    /// Writes the high byte first; the low one passes both on.
    pub(crate) fn write(self, value: u16) {
        let [low, high] = value.to_le_bytes();
        self.high.write(high);
        self.low.write(low);
    }
}

/// The bit of number `n`.
pub(crate) const fn bit(n: u8) -> u8 {
    1 << n
}

pub(crate) const PINB: Register = Register(0x23);
pub(crate) const DDRB: Register = Register(0x24);
pub(crate) const PORTB: Register = Register(0x25);
pub(crate) const PINC: Register = Register(0x26);
pub(crate) const PORTC: Register = Register(0x28);
pub(crate) const DDRD: Register = Register(0x2A);
pub(crate) const PORTD: Register = Register(0x2B);

pub(crate) const TIFR1: Register = Register(0x36);
pub(crate) const TOV1: u8 = bit(0);
pub(crate) const TIMSK1: Register = Register(0x6F);
pub(crate) const TOIE1: u8 = bit(0);
pub(crate) const OCIE1A: u8 = bit(1);
pub(crate) const TCCR1B: Register = Register(0x81);
pub(crate) const CS11: u8 = bit(1);
pub(crate) const TCNT1: WideRegister = WideRegister::at(0x84);
pub(crate) const OCR1A: WideRegister = WideRegister::at(0x88);

pub(crate) const EECR: Register = Register(0x3F);
pub(crate) const EERE: u8 = bit(0);
pub(crate) const EEPE: u8 = bit(1);
pub(crate) const EEDR: Register = Register(0x40);
pub(crate) const EEAR: WideRegister = WideRegister::at(0x41);

pub(crate) const PCICR: Register = Register(0x68);
pub(crate) const PCIE1: u8 = bit(1);
pub(crate) const PCMSK1: Register = Register(0x6C);
pub(crate) const PCINT8: u8 = bit(0);

pub(crate) const ADC: WideRegister = WideRegister::at(0x78);
pub(crate) const ADCSRA: Register = Register(0x7A);
pub(crate) const ADEN: u8 = bit(7);
pub(crate) const ADSC: u8 = bit(6);
pub(crate) const ADATE: u8 = bit(5);
pub(crate) const ADPS_128: u8 = 0b111;
pub(crate) const ADMUX: Register = Register(0x7C);
pub(crate) const REFS_AVCC: u8 = bit(6);
pub(crate) const DIDR0: Register = Register(0x7E);

pub(crate) const UCSR0A: Register = Register(0xC0);
pub(crate) const RXC0: u8 = bit(7);
pub(crate) const FE0: u8 = bit(4);
pub(crate) const DOR0: u8 = bit(3);
pub(crate) const U2X0: u8 = bit(1);
pub(crate) const UCSR0B: Register = Register(0xC1);
pub(crate) const RXCIE0: u8 = bit(7);
pub(crate) const UDRIE0: u8 = bit(5);
pub(crate) const RXEN0: u8 = bit(4);
pub(crate) const TXEN0: u8 = bit(3);
pub(crate) const UCSR0C: Register = Register(0xC2);
pub(crate) const UCSZ_8: u8 = 0b110;
pub(crate) const UBRR0: WideRegister = WideRegister::at(0xC4);
pub(crate) const UDR0: Register = Register(0xC6);

pub(crate) const WDRF: u8 = bit(3);
pub(crate) const BORF: u8 = bit(2);
pub(crate) const EXTRF: u8 = bit(1);
pub(crate) const PORF: u8 = bit(0);
pub(crate) const WDIE: u8 = bit(6);
pub(crate) const WDCE: u8 = bit(4);
pub(crate) const WDE: u8 = bit(3);
