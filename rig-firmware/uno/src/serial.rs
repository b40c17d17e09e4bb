//! The serial line: 115200 baud, eight bits, no parity, with a buffer in each direction.
//!
//! Real-time bytes take effect in the receive interrupt, however full the buffer is.

use rig_firmware::board::Events;
use rig_firmware::realtime::{Received, classify};

use crate::common::{EVENTS, STEPPER};
use crate::masked::{Masked, Shared};
use crate::registers::{
    DOR0, FE0, RXC0, RXCIE0, RXEN0, TXEN0, U2X0, UBRR0, UCSR0A, UCSR0B, UCSR0C, UCSZ_8, UDR0,
    UDRIE0,
};

/// 16 MHz / 8 / 17 = 117647 baud, 2.1 % fast: as Arduino's and Grbl's own firmware.
const DIVISOR: u16 = 16;

static RECEIVED: Shared<Ring<128>> = Shared::new(Ring::new());
static TO_SEND: Shared<Ring<64>> = Shared::new(Ring::new());

/// Bytes on their way, first in, first out. `N` is a power of two up to 128.
struct Ring<const N: usize> {
    bytes: [u8; N],
    first: u8,
    length: u8,
}

impl<const N: usize> Ring<N> {
    const fn new() -> Ring<N> {
        assert!(N.is_power_of_two() && N <= 128);
        Ring {
            bytes: [0; N],
            first: 0,
            length: 0,
        }
    }

    fn room(&self) -> u8 {
        N as u8 - self.length
    }

    /// Appends a byte; false if the queue is full.
    fn push(&mut self, byte: u8) -> bool {
        if self.room() == 0 {
            return false;
        }
        let end = self.first.wrapping_add(self.length);
        self.bytes[usize::from(end) % N] = byte;
        self.length += 1;
        true
    }

    fn pop(&mut self) -> Option<u8> {
        if self.length == 0 {
            return None;
        }
        let byte = self.bytes[usize::from(self.first) % N];
        self.first = self.first.wrapping_add(1);
        self.length -= 1;
        Some(byte)
    }
}

/// Opens the line.
pub(crate) fn start() {
    UBRR0.write(DIVISOR);
    UCSR0A.write(U2X0);
    UCSR0C.write(UCSZ_8);
    UCSR0B.write(RXEN0 | TXEN0 | RXCIE0);
}

/// The next byte of a line.
pub(crate) fn receive(masked: &mut Masked) -> Option<u8> {
    RECEIVED.lend(masked).pop()
}

/// How many more bytes can be received.
pub(crate) fn receive_room(masked: &mut Masked) -> u8 {
    RECEIVED.lend(masked).room()
}

/// Queues a byte to be sent; false if the queue is full.
pub(crate) fn send(byte: u8, masked: &mut Masked) -> bool {
    let queued = TO_SEND.lend(masked).push(byte);
    if queued {
        UCSR0B.change(UDRIE0, true);
    }
    queued
}

/// A byte came; more may have come behind a long interrupt.
#[unsafe(no_mangle)]
extern "avr-interrupt" fn __vector_18() {
    // SAFETY: the one proof of this handler, and interrupts never nest.
    let mut masked = unsafe { Masked::in_interrupt() };
    loop {
        // The flags are those of the byte that is read after them.
        let status = UCSR0A.read();
        if status & RXC0 == 0 {
            return;
        }
        let events = take_in(UDR0.read(), status, &mut masked);
        EVENTS.lend(&mut masked).insert(events);
    }
}

fn take_in(byte: u8, status: u8, masked: &mut Masked) -> Events {
    let mut events = Events::RECEIVED;
    if status & (FE0 | DOR0) != 0 {
        events.insert(Events::LOST_INPUT);
    }
    if status & FE0 != 0 {
        return events;
    }
    match classify(byte) {
        Received::Data(byte) => {
            if !RECEIVED.lend(masked).push(byte) {
                events.insert(Events::LOST_INPUT);
            }
        }
        Received::Realtime(realtime) => {
            STEPPER.lend(masked).obey(realtime);
            events.insert(realtime.into());
        }
    }
    events
}

/// There is room for a byte to be sent.
#[unsafe(no_mangle)]
extern "avr-interrupt" fn __vector_19() {
    // SAFETY: the one proof of this handler, and interrupts never nest.
    let mut masked = unsafe { Masked::in_interrupt() };
    match TO_SEND.lend(&mut masked).pop() {
        Some(byte) => UDR0.write(byte),
        None => UCSR0B.change(UDRIE0, false),
    }
}
