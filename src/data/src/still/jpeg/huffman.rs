//! The bits of a scan, and Huffman's codes in them (ITU-T T.81, annex F).

/// Codes of 1 to 16 bits; only their meaning is kept.
#[derive(Clone)]
pub(super) struct Codes {
    /// Of each length the first code, and how many there are.
    lengths: [(u32, u32); 16],
    symbols: Vec<u8>,
}

impl Codes {
    /// A table of a segment DHT behind its class, and what follows it.
    pub(super) fn read(content: &[u8]) -> Option<(Self, &[u8])> {
        let counts = content.get(..16)?;
        let total: usize = counts.iter().map(|&count| usize::from(count)).sum();
        let symbols = content.get(16..16 + total)?.to_vec();
        let mut code = 0_u32;
        let lengths = std::array::from_fn(|at| {
            let first = code;
            let count = u32::from(counts[at]);
            code = (code + count) << 1;
            (first, count)
        });
        Some((Self { lengths, symbols }, &content[16 + total..]))
    }
}

/// Reads a scan bit by bit. Nothing is made up behind its end.
pub(super) struct Bits<'a> {
    bytes: &'a [u8],
    at: usize,
    byte: u8,
    left: u32,
}

impl<'a> Bits<'a> {
    pub(super) fn new(bytes: &'a [u8], at: usize) -> Self {
        Self {
            bytes,
            at,
            byte: 0,
            left: 0,
        }
    }

    /// The place behind the byte that was begun last.
    pub(super) fn place(&self) -> usize {
        self.at
    }

    /// The next bit; none at a marker or the file's end.
    pub(super) fn bit(&mut self) -> Option<u32> {
        if self.left == 0 {
            self.byte = *self.bytes.get(self.at)?;
            self.at += 1;
            if self.byte == 0xff {
                if self.bytes.get(self.at) != Some(&0) {
                    self.at -= 1;
                    return None;
                }
                self.at += 1;
            }
            self.left = 8;
        }
        self.left -= 1;
        Some(u32::from(self.byte >> self.left & 1))
    }

    pub(super) fn number(&mut self, bits: u8) -> Option<u32> {
        let mut value = 0;
        for _ in 0..bits {
            value = value << 1 | self.bit()?;
        }
        Some(value)
    }

    /// What the next code means; `None` for an unknown code.
    pub(super) fn symbol(&mut self, codes: &Codes) -> Option<u8> {
        let (mut code, mut index) = (0, 0);
        for (first, count) in codes.lengths {
            code = code << 1 | self.bit()?;
            if code < first + count {
                let place = index + code.checked_sub(first)?;
                return codes.symbols.get(place as usize).copied();
            }
            index += count;
        }
        None
    }

    /// Goes behind a restart marker.
    pub(super) fn restart(&mut self) -> Option<()> {
        self.left = 0;
        while self.bytes.get(self.at..)?.starts_with(&[0xff, 0xff]) {
            self.at += 1;
        }
        match self.bytes.get(self.at..self.at + 2)? {
            [0xff, 0xd0..=0xd7] => {
                self.at += 2;
                Some(())
            }
            _ => None,
        }
    }
}
