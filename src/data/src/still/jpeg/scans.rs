//! Goes through the scans of a JPEG and counts its blocks, without decoding them (ITU-T T.81, annexes F and G).

use super::huffman::{Bits, Codes};
use super::{EOI, SOS, is_frame, segment};

/// Coefficients of a block.
const BLOCK: usize = 64;
/// Pictures have no more components, and no more scans.
const MAX_COMPONENTS: u8 = 4;
const MAX_SCANS: usize = 100;
/// The most blocks whose non-zero places are remembered.
const MAX_BLOCKS: usize = 1 << 24;
const DHT: u8 = 0xc4;
const DRI: u8 = 0xdd;
/// Sequential and progressive frames with Huffman's codes.
const SEQUENTIAL: [u8; 2] = [0xc0, 0xc1];
const PROGRESSIVE: u8 = 0xc2;

/// The place behind the last scan; `None` if a scan is not whole, or scans are missing.
pub(super) fn end(bytes: &[u8]) -> Option<usize> {
    let mut tables = Tables::default();
    let mut frame = None;
    let (mut at, mut scans) = (2, 0);
    loop {
        let (marker, content, after) = segment(bytes, at)?;
        at = after;
        match marker {
            EOI => return None,
            DHT => tables.read(content)?,
            DRI => {
                tables.restart = u32::from(u16::from_be_bytes(content.get(..2)?.try_into().ok()?))
            }
            SOS => {
                scans += 1;
                if scans > MAX_SCANS {
                    return None;
                }
                let frame: &mut Frame = frame.as_mut()?;
                let scan = Scan::read(content, frame)?;
                at = frame.pass(&scan, &tables, Bits::new(bytes, after))?;
                if frame.is_whole() {
                    return Some(at);
                }
            }
            marker if is_frame(marker) => frame = Some(Frame::read(marker, content)?),
            _ => {}
        }
    }
}

#[derive(Default)]
struct Tables {
    /// Those of DC, then those of AC.
    codes: [[Option<Codes>; 4]; 2],
    /// MCUs between restart markers, or 0.
    restart: u32,
}

impl Tables {
    fn read(&mut self, mut content: &[u8]) -> Option<()> {
        while let Some((&place, rest)) = content.split_first() {
            let (codes, rest) = Codes::read(rest)?;
            let class = self.codes.get_mut(usize::from(place >> 4))?;
            *class.get_mut(usize::from(place & 15))? = Some(codes);
            content = rest;
        }
        Some(())
    }
}

struct Component {
    id: u8,
    /// Blocks of an MCU, across and down.
    sampling: [usize; 2],
    /// Its own blocks, across and down.
    blocks: [usize; 2],
    /// Blocks in a row with those that fill up the last MCU.
    stride: usize,
    /// Of a progressive frame: a bit for each coefficient of a block that is not zero.
    known: Vec<u64>,
    /// The lowest bit of each coefficient that a scan has brought.
    lowest: [Option<u8>; BLOCK],
}

struct Frame {
    is_progressive: bool,
    /// Across and down.
    mcus: [usize; 2],
    components: Vec<Component>,
}

impl Frame {
    fn read(marker: u8, content: &[u8]) -> Option<Self> {
        let is_progressive = marker == PROGRESSIVE;
        if !is_progressive && !SEQUENTIAL.contains(&marker) {
            return None;
        }
        let side = |at: usize| {
            Some(usize::from(u16::from_be_bytes(
                content.get(at..at + 2)?.try_into().ok()?,
            )))
        };
        let size = [side(3)?, side(1)?];
        let count = *content.get(5).filter(|&&count| count <= MAX_COMPONENTS)?;
        let parts = content.get(6..6 + 3 * usize::from(count))?;
        let sampling = |part: &[u8]| [usize::from(part[1] >> 4), usize::from(part[1] & 15)];
        let parts = parts.chunks_exact(3);
        let mut most = [0; 2];
        for part in parts.clone() {
            let sampling = sampling(part);
            if !sampling.iter().all(|factor| (1..=4).contains(factor)) {
                return None;
            }
            most = [0, 1].map(|axis| most[axis].max(sampling[axis]));
        }
        if size.contains(&0) || most.contains(&0) {
            return None;
        }
        let mcus: [usize; 2] = [0, 1].map(|axis| size[axis].div_ceil(8 * most[axis]));
        let component = |part: &[u8]| {
            let sampling = sampling(part);
            let stride = mcus[0] * sampling[0];
            let count = stride * mcus[1] * sampling[1];
            Component {
                id: part[0],
                sampling,
                blocks: [0, 1].map(|axis| {
                    (size[axis] * sampling[axis])
                        .div_ceil(most[axis])
                        .div_ceil(8)
                }),
                stride,
                known: vec![
                    0;
                    if is_progressive && count <= MAX_BLOCKS {
                        count
                    } else {
                        0
                    }
                ],
                lowest: [None; BLOCK],
            }
        };
        Some(Self {
            is_progressive,
            mcus,
            components: parts.map(component).collect(),
        })
    }

    /// Whether scans have brought all coefficients with all bits.
    fn is_whole(&self) -> bool {
        let mut lowest = self
            .components
            .iter()
            .flat_map(|component| component.lowest);
        lowest.all(|bit| bit == Some(0))
    }

    /// Goes through a scan: the place behind it.
    fn pass(&mut self, scan: &Scan, tables: &Tables, mut bits: Bits<'_>) -> Option<usize> {
        let is_interleaved = scan.parts.len() > 1;
        let mcus = match &scan.parts[..] {
            [only] => self.components.get(only.component)?.blocks,
            _ => self.mcus,
        };
        let mut run = 0;
        for number in 0..mcus[0] * mcus[1] {
            if tables.restart > 0 && number > 0 && number % tables.restart as usize == 0 {
                bits.restart()?;
                run = 0;
            }
            let place = [number % mcus[0], number / mcus[0]];
            for part in &scan.parts {
                let component = self.components.get_mut(part.component)?;
                let [across, down] = if is_interleaved {
                    component.sampling
                } else {
                    [1, 1]
                };
                for block in 0..across * down {
                    let x = place[0] * across + block % across;
                    let y = place[1] * down + block / across;
                    let known = component.known.get_mut(y * component.stride + x);
                    let codes = part
                        .codes
                        .map(|[class, place]| tables.codes[class][place].as_ref());
                    if self.is_progressive {
                        scan.pass_progressive(codes, &mut bits, &mut run, known?)?;
                    } else {
                        pass_sequential(codes, &mut bits)?;
                    }
                }
            }
        }
        for part in &scan.parts {
            let component = self.components.get_mut(part.component)?;
            component
                .lowest
                .get_mut(scan.first..=scan.last)?
                .fill(Some(scan.low));
        }
        Some(bits.place())
    }
}

/// A component of a scan.
struct Part {
    component: usize,
    /// Class and place of its tables.
    codes: [[usize; 2]; 2],
}

struct Scan {
    parts: Vec<Part>,
    /// The first and the last coefficient.
    first: usize,
    last: usize,
    /// The lowest bit that scans before have brought, or 0, and the lowest of this scan.
    high: u8,
    low: u8,
}

impl Scan {
    fn read(content: &[u8], frame: &Frame) -> Option<Self> {
        let count = usize::from(*content.first()?);
        let parts = content.get(1..1 + 2 * count)?.chunks_exact(2);
        let parts = parts.map(|part| {
            let component = frame
                .components
                .iter()
                .position(|component| component.id == part[0])?;
            let [dc, ac] = [part[1] >> 4, part[1] & 15].map(usize::from);
            (dc < 4 && ac < 4).then_some(Part {
                component,
                codes: [[0, dc], [1, ac]],
            })
        });
        let parts: Vec<Part> = parts.collect::<Option<_>>()?;
        let rest = content.get(1 + 2 * count..4 + 2 * count)?;
        let (first, last) = (usize::from(rest[0]), usize::from(rest[1]));
        let scan = if frame.is_progressive {
            Self {
                parts,
                first,
                last,
                high: rest[2] >> 4,
                low: rest[2] & 15,
            }
        } else {
            Self {
                parts,
                first: 0,
                last: BLOCK - 1,
                high: 0,
                low: 0,
            }
        };
        let is_possible = !scan.parts.is_empty() && scan.first <= scan.last && scan.last < BLOCK;
        is_possible.then_some(scan)
    }

    fn pass_progressive(
        &self,
        [dc, ac]: [Option<&Codes>; 2],
        bits: &mut Bits<'_>,
        run: &mut u32,
        known: &mut u64,
    ) -> Option<()> {
        match (self.first, self.high) {
            (0, 0) => {
                let size = bits.symbol(dc?)?;
                bits.number(size).map(drop)
            }
            (0, _) => bits.bit().map(drop),
            (_, 0) => self.pass_first(ac?, bits, run, known),
            _ => self.refine(ac?, bits, run, known),
        }
    }

    /// The first bits of AC coefficients.
    fn pass_first(
        &self,
        ac: &Codes,
        bits: &mut Bits<'_>,
        run: &mut u32,
        known: &mut u64,
    ) -> Option<()> {
        if *run > 0 {
            *run -= 1;
            return Some(());
        }
        let mut at = self.first;
        while at <= self.last {
            let symbol = bits.symbol(ac)?;
            let (zeros, size) = (symbol >> 4, symbol & 15);
            match (zeros, size) {
                (15, 0) => at += 16,
                (bits_of_run, 0) => {
                    *run = (1 << bits_of_run) - 1 + bits.number(bits_of_run)?;
                    break;
                }
                _ => {
                    at += usize::from(zeros);
                    bits.number(size)?;
                    *known |= bit_of(at)?;
                    at += 1;
                }
            }
        }
        Some(())
    }

    /// One bit more of AC coefficients.
    fn refine(
        &self,
        ac: &Codes,
        bits: &mut Bits<'_>,
        run: &mut u32,
        known: &mut u64,
    ) -> Option<()> {
        let mut at = self.first;
        while *run == 0 && at <= self.last {
            let symbol = bits.symbol(ac)?;
            let (mut zeros, size) = (symbol >> 4, symbol & 15);
            if size == 0 && zeros < 15 {
                *run = (1 << zeros) + bits.number(zeros)?;
                break;
            }
            if size > 0 {
                bits.bit()?;
            }
            while at <= self.last {
                if *known & bit_of(at)? != 0 {
                    bits.bit()?;
                } else if zeros == 0 {
                    break;
                } else {
                    zeros -= 1;
                }
                at += 1;
            }
            if size > 0 && at <= self.last {
                *known |= bit_of(at)?;
            }
            at += 1;
        }
        if *run > 0 {
            for at in at..=self.last {
                if *known & bit_of(at)? != 0 {
                    bits.bit()?;
                }
            }
            *run -= 1;
        }
        Some(())
    }
}

fn bit_of(coefficient: usize) -> Option<u64> {
    1_u64.checked_shl(u32::try_from(coefficient).ok()?)
}

fn pass_sequential([dc, ac]: [Option<&Codes>; 2], bits: &mut Bits<'_>) -> Option<()> {
    let size = bits.symbol(dc?)?;
    bits.number(size)?;
    let mut at = 1;
    while at < BLOCK {
        let symbol = bits.symbol(ac?)?;
        match (symbol >> 4, symbol & 15) {
            (15, 0) => at += 16,
            (_, 0) => break,
            (zeros, size) => {
                bits.number(size)?;
                at += usize::from(zeros) + 1;
            }
        }
    }
    Some(())
}
