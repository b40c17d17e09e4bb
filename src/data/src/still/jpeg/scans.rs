//! Goes through the scans of a sequential JPEG and counts its blocks, without decoding them (ITU-T T.81, annex F). Cameras
//! that forget the end marker write no others.

use super::huffman::{Bits, Codes};
use super::{EOI, SOS, is_frame, segment};

/// Coefficients of a block.
const BLOCK: usize = 64;
/// Pictures have no more components, and no more scans.
const MAX_COMPONENTS: u8 = 4;
const MAX_SCANS: usize = 100;
const DHT: u8 = 0xc4;
const DRI: u8 = 0xdd;
/// Sequential frames with Huffman's codes.
const SEQUENTIAL: [u8; 2] = [0xc0, 0xc1];

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
    /// Whether a scan has brought it.
    is_there: bool,
}

struct Frame {
    /// Across and down.
    mcus: [usize; 2],
    components: Vec<Component>,
}

impl Frame {
    fn read(marker: u8, content: &[u8]) -> Option<Self> {
        if !SEQUENTIAL.contains(&marker) {
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
            Component {
                id: part[0],
                sampling,
                blocks: [0, 1].map(|axis| {
                    (size[axis] * sampling[axis])
                        .div_ceil(most[axis])
                        .div_ceil(8)
                }),
                is_there: false,
            }
        };
        Some(Self {
            mcus,
            components: parts.map(component).collect(),
        })
    }

    /// Whether scans have brought all components.
    fn is_whole(&self) -> bool {
        self.components.iter().all(|component| component.is_there)
    }

    /// Goes through a scan: the place behind it.
    fn pass(&mut self, scan: &Scan, tables: &Tables, mut bits: Bits<'_>) -> Option<usize> {
        let is_interleaved = scan.parts.len() > 1;
        let mcus = match &scan.parts[..] {
            [only] => self.components.get(only.component)?.blocks,
            _ => self.mcus,
        };
        for number in 0..mcus[0] * mcus[1] {
            if tables.restart > 0 && number > 0 && number % tables.restart as usize == 0 {
                bits.restart()?;
            }
            for part in &scan.parts {
                let [across, down] = self.components.get(part.component)?.sampling;
                let blocks = if is_interleaved { across * down } else { 1 };
                let [dc, ac] = part
                    .codes
                    .map(|[class, place]| tables.codes[class][place].as_ref());
                for _ in 0..blocks {
                    pass_block(dc?, ac?, &mut bits)?;
                }
            }
        }
        for part in &scan.parts {
            self.components.get_mut(part.component)?.is_there = true;
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
        (!parts.is_empty()).then_some(Self { parts })
    }
}

fn pass_block(dc: &Codes, ac: &Codes, bits: &mut Bits<'_>) -> Option<()> {
    let size = bits.symbol(dc)?;
    bits.number(size)?;
    let mut at = 1;
    while at < BLOCK {
        let symbol = bits.symbol(ac)?;
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
