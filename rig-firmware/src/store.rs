//! Settings in the EEPROM, safe against a supply that goes away while writing.
//!
//! Two slots take turns: what is written goes to the slot that does not hold the present values,
//! and counts only when its checksum, which is written last, is right.
//!
//! Slot: version, generation, the settings as little-endian `i32`, CRC.

use crate::board::Board;
use crate::crc::Crc;
use crate::settings::{COUNT, GrblSettings};

const VERSION: u8 = 1;
/// Bytes before the checksum.
const BODY: u16 = 2 + 4 * COUNT as u16;
/// Bytes from one slot to the next.
const STRIDE: u16 = 128;
/// What an EEPROM holds before it was ever written.
const BLANK: u8 = 0xFF;

/// How the EEPROM was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Health {
    /// Whole, or never written.
    Good,
    /// A slot was damaged: what the other one holds is in use, or the defaults.
    Damaged,
}

/// Which slot holds the present values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Store {
    second: bool,
    generation: u8,
}

/// What a slot holds; its values are read only when they are wanted, for they take a good part of
/// the chip's memory.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Slot {
    Blank,
    Damaged,
    Whole { generation: u8 },
}

impl Store {
    /// Reads what is stored. Damage is mended: the next call finds both slots good.
    pub(crate) fn open(board: &mut impl Board) -> (Store, GrblSettings, Health) {
        let slots = [examine(board, false), examine(board, true)];
        let mut store = Store::newest(slots);
        let mut found = store.and_then(|store| read(board, store.second));
        let mut damaged = slots.contains(&Slot::Damaged);
        if let (Some(refused), None) = (store, found) {
            // The checksum is right and the values are not: as another version left them.
            damaged = true;
            store = Store::from_slots(slots, !refused.second);
            found = store.and_then(|store| read(board, store.second));
        }
        let none = found.is_none();
        let stored = found.unwrap_or_else(GrblSettings::defaults);
        let mut store = store.unwrap_or(Store {
            second: true,
            generation: 0,
        });
        if !damaged {
            return (store, stored, Health::Good);
        }
        store.write(board, &stored);
        if none {
            store.write(board, &stored);
        }
        (store, stored, Health::Damaged)
    }

    /// The slot that was written last.
    fn newest(slots: [Slot; 2]) -> Option<Store> {
        match (
            Store::from_slots(slots, false),
            Store::from_slots(slots, true),
        ) {
            (Some(a), Some(b)) if (b.generation.wrapping_sub(a.generation) as i8) > 0 => Some(b),
            (a, b) => a.or(b),
        }
    }

    /// One slot, if it is whole.
    fn from_slots(slots: [Slot; 2], second: bool) -> Option<Store> {
        match slots[usize::from(second)] {
            Slot::Whole { generation } => Some(Store { second, generation }),
            Slot::Blank | Slot::Damaged => None,
        }
    }

    /// Writes what has changed. Takes 3.4 ms for every byte that differs from what stands there.
    pub(crate) fn write(&mut self, board: &mut impl Board, stored: &GrblSettings) {
        self.second = !self.second;
        self.generation = self.generation.wrapping_add(1);
        let start = start(self.second);
        let mut crc = Crc::new();
        for at in 0..BODY {
            let byte = body(stored, self.generation, at);
            crc.update(byte);
            put(board, start + at, byte);
        }
        let [high, low] = crc.value().to_be_bytes();
        put(board, start + BODY, high);
        put(board, start + BODY + 1, low);
    }
}

fn start(second: bool) -> u16 {
    if second { STRIDE } else { 0 }
}

/// The byte at a place of a slot's body.
fn body(stored: &GrblSettings, generation: u8, at: u16) -> u8 {
    let Some(at) = at.checked_sub(2) else {
        return if at == 0 { VERSION } else { generation };
    };
    let value = stored.values().get(usize::from(at / 4));
    let word = value.copied().unwrap_or(0);
    (word >> (8 * (at % 4))) as u8
}

fn put(board: &mut impl Board, address: u16, byte: u8) {
    if board.eeprom_read(address) != byte {
        board.eeprom_write(address, byte);
        board.pet_watchdog();
    }
}

/// Whether a slot's checksum is right.
fn examine(board: &mut impl Board, second: bool) -> Slot {
    let start = start(second);
    let mut crc = Crc::new();
    let mut blank = true;
    for at in 0..BODY {
        let byte = board.eeprom_read(start + at);
        crc.update(byte);
        blank &= byte == BLANK;
    }
    let sum = [
        board.eeprom_read(start + BODY),
        board.eeprom_read(start + BODY + 1),
    ];
    if blank && sum == [BLANK; 2] {
        return Slot::Blank;
    }
    if u16::from_be_bytes(sum) != crc.value() || board.eeprom_read(start) != VERSION {
        return Slot::Damaged;
    }
    Slot::Whole {
        generation: board.eeprom_read(start + 1),
    }
}

/// The values of a slot; `None` if they are not allowed.
fn read(board: &mut impl Board, second: bool) -> Option<GrblSettings> {
    let mut at = start(second) + 2;
    let mut word = || {
        let bytes = core::array::from_fn(|_| {
            at += 1;
            board.eeprom_read(at - 1)
        });
        i32::from_le_bytes(bytes)
    };
    let mut values = [0; COUNT];
    values.iter_mut().for_each(|value| *value = word());
    GrblSettings::from_values(values)
}
