//! What the table sends: text, numbers and line ends, checked where a session asks for it.
//!
//! Knows a board to send to; nothing of states. Texts are short and few: they lie in the chip's
//! memory.

use crate::board::Board;
use crate::crc::Crc;
use crate::settings::{GrblSettings, Key, Kind};

/// One line on its way out; [`Reply::end`] ends it.
pub(crate) struct Reply<'a, B: Board> {
    board: &'a mut B,
    crc: Option<Crc>,
}

impl<'a, B: Board> Reply<'a, B> {
    /// Begins a line; `checked`: it ends with `*` and its checksum.
    pub(crate) fn new(board: &'a mut B, checked: bool) -> Reply<'a, B> {
        Reply {
            board,
            crc: checked.then(Crc::new),
        }
    }

    /// Sends a byte.
    pub(crate) fn byte(&mut self, byte: u8) {
        if let Some(crc) = &mut self.crc {
            crc.update(byte);
        }
        self.board.send(byte);
    }

    /// Sends a text.
    pub(crate) fn text(&mut self, text: &str) -> &mut Self {
        text.bytes().for_each(|byte| self.byte(byte));
        self
    }

    /// Sends a whole number.
    pub(crate) fn whole(&mut self, number: u32) -> &mut Self {
        self.digits(number, 0)
    }

    /// Sends a number of 10^-`decimals`.
    pub(crate) fn decimal(&mut self, number: i32, decimals: u8) -> &mut Self {
        if number < 0 {
            self.byte(b'-');
        }
        self.digits(number.unsigned_abs(), decimals)
    }

    fn digits(&mut self, mut number: u32, decimals: u8) -> &mut Self {
        let mut digits = [b'0'; 10];
        let mut count = 0;
        for digit in &mut digits {
            *digit += (number % 10) as u8;
            number /= 10;
            count += 1;
            if number == 0 && count > decimals {
                break;
            }
        }
        for place in (0..count).rev() {
            let digit = digits.get(usize::from(place)).copied().unwrap_or(b'0');
            self.byte(digit);
            if place == decimals && place > 0 {
                self.byte(b'.');
            }
        }
        self
    }

    /// Sends a position, thousandths of a degree, as three axes; the table has only the first.
    pub(crate) fn position(&mut self, position: i32) -> &mut Self {
        self.decimal(position, 3).text(",0.000,0.000")
    }

    /// Sends a speed in thousandths of a degree/min, as whole units/min.
    pub(crate) fn speed(&mut self, feed: u32) -> &mut Self {
        self.whole(feed.saturating_add(500) / 1000)
    }

    /// Ends the line.
    pub(crate) fn end(&mut self) {
        if let Some(crc) = self.crc.take() {
            self.board.send(b'*');
            for shift in [12, 8, 4, 0] {
                let digit = (crc.value() >> shift) as u8 & 0xF;
                let letter = if digit < 10 { b'0' } else { b'A' - 10 };
                self.board.send(letter + digit);
            }
        }
        self.board.send(b'\r');
        self.board.send(b'\n');
        self.board.pet_watchdog();
    }
}

/// Answers a line: `ok`, `error:5`, `ok N17`.
pub(crate) fn answer<B: Board>(board: &mut B, checked: bool, sequence: Option<u32>, answer: u8) {
    let mut reply = Reply::new(board, checked);
    if answer == 0 {
        reply.text("ok");
    } else {
        reply.text("error:").whole(u32::from(answer));
    }
    if let Some(sequence) = sequence {
        reply.text(" N").whole(sequence);
    }
    reply.end();
}

/// Tells one setting: `$100=88.889`.
pub(crate) fn setting<B: Board>(board: &mut B, checked: bool, settings: &GrblSettings, key: Key) {
    let mut reply = Reply::new(board, checked);
    reply.text("$").whole(u32::from(key.number())).text("=");
    let decimals = match key.kind() {
        Kind::Whole => 0,
        Kind::Decimal => 3,
    };
    reply.decimal(settings.get(key), decimals).end();
}
