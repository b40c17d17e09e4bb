//! An H.264 stream of field pictures, as camcorders write it, by ITU-T H.264, 7.3: each frame is two coded fields, whose
//! macroblocks are samples (I_PCM) or repeat those before (P_Skip).

use crate::numbered::{HEIGHT, Planes, WIDTH};

/// Frames from one IDR picture to the next.
const GROUP: u64 = 6;
const BLOCKS: (usize, usize) = (WIDTH / 16, HEIGHT / 16);

#[derive(Default)]
struct Bits(Vec<bool>);

impl Bits {
    fn fixed(&mut self, bits: u32, value: u64) {
        self.0
            .extend((0..bits).rev().map(|at| value >> at & 1 == 1));
    }

    fn unsigned(&mut self, value: u64) {
        let bits = (value + 1).ilog2();
        self.fixed(bits, 0);
        self.fixed(bits + 1, value + 1);
    }

    fn align(&mut self) {
        self.0.resize(self.0.len().next_multiple_of(8), false);
    }

    /// The unit, with bytes that keep its data from looking like a start code.
    fn unit(mut self, header: u8) -> Vec<u8> {
        self.0.push(true);
        self.align();
        let mut unit = vec![0, 0, 0, 1, header];
        let mut zeros = 0;
        for bits in self.0.chunks(8) {
            let byte = bits.iter().fold(0, |byte, &bit| byte << 1 | u8::from(bit));
            if zeros >= 2 && byte <= 3 {
                unit.push(3);
                zeros = 0;
            }
            unit.push(byte);
            zeros = if byte == 0 { zeros + 1 } else { 0 };
        }
        unit
    }
}

fn sequence_parameters() -> Vec<u8> {
    let mut bits = Bits::default();
    bits.fixed(24, 0x4d_00_1e);
    for value in [0, 0, 0, 4, 2] {
        bits.unsigned(value);
    }
    bits.fixed(1, 0);
    bits.unsigned(BLOCKS.0 as u64 - 1);
    bits.unsigned(BLOCKS.1 as u64 / 2 - 1);
    // Fields are allowed, macroblock-adaptive ones are not; direct_8x8_inference; no cropping and no VUI.
    bits.fixed(5, 0b00100);
    bits.unit(0x67)
}

fn picture_parameters() -> Vec<u8> {
    let mut bits = Bits::default();
    bits.unsigned(0);
    bits.unsigned(0);
    bits.fixed(2, 0);
    for _ in 0..3 {
        bits.unsigned(0);
    }
    bits.fixed(3, 0);
    for _ in 0..3 {
        bits.unsigned(0);
    }
    bits.fixed(3, 0b100);
    bits.unit(0x68)
}

fn field(number: u64, bottom: usize, planes: &Planes) -> Vec<u8> {
    let place = number % GROUP;
    let (intra, idr) = (place == 0, place == 0 && bottom == 0);
    let mut bits = Bits::default();
    bits.unsigned(0);
    bits.unsigned(if intra { 7 } else { 5 });
    bits.unsigned(0);
    bits.fixed(4, place);
    bits.fixed(2, 2 + bottom as u64);
    if idr {
        bits.unsigned(number / GROUP % 2);
    }
    bits.fixed(8, 2 * place + bottom as u64);
    if !intra {
        bits.fixed(2, 0);
    }
    bits.fixed(if idr { 2 } else { 1 }, 0);
    bits.unsigned(0);
    bits.unsigned(1);
    for block in 0..BLOCKS.0 * BLOCKS.1 / 2 {
        let (across, down) = (block % BLOCKS.0, block / BLOCKS.0);
        if !intra && down > 0 {
            let skipped = BLOCKS.0 * (BLOCKS.1 / 2 - 1);
            bits.unsigned(skipped as u64);
            break;
        }
        if intra {
            bits.unsigned(25);
        } else {
            bits.unsigned(0);
            bits.unsigned(30);
        }
        bits.align();
        for (plane, side) in [(&planes.luma, 16), (&planes.blue, 8), (&planes.red, 8)] {
            for y in 0..side {
                for x in 0..side {
                    let row = 2 * (side * down + y) + bottom;
                    let width = side * BLOCKS.0;
                    bits.fixed(8, u64::from(plane[row * width + side * across + x]));
                }
            }
        }
    }
    bits.unit(if idr { 0x65 } else { 0x41 })
}

/// A stream of so many frames.
pub(crate) fn stream(frames: u64) -> Vec<u8> {
    let delimiter = || {
        let mut bits = Bits::default();
        bits.fixed(3, 7);
        bits.unit(9)
    };
    let mut stream = Vec::new();
    for number in 0..frames {
        let planes = Planes::numbered(number);
        for bottom in [0, 1] {
            stream.extend(delimiter());
            if number % GROUP == 0 && bottom == 0 {
                stream.extend(sequence_parameters());
                stream.extend(picture_parameters());
            }
            stream.extend(field(number, bottom, &planes));
        }
    }
    stream
}
