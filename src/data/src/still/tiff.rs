//! The directories of a TIFF; Exif data are such directories too.

pub(super) const NEW_SUBFILE_TYPE: u16 = 254;
pub(super) const PHOTOMETRIC: u16 = 262;
pub(super) const MAKE: u16 = 271;
pub(super) const SUB_IFDS: u16 = 330;
pub(super) const EXIF_IFD: u16 = 0x8769;
pub(super) const COLOUR_SPACE: u16 = 0xa001;
pub(super) const INTEROPERABILITY_IFD: u16 = 0xa005;
pub(super) const INTEROPERABILITY_INDEX: u16 = 1;
pub(super) const DNG_VERSION: u16 = 50706;

/// Bytes of an entry.
const ENTRY: usize = 12;

/// One directory: entries of a tag, a type, a count and a value or where it is.
#[derive(Clone, Copy)]
pub(super) struct Directory<'a> {
    bytes: &'a [u8],
    entries: &'a [u8],
    is_big_endian: bool,
}

impl<'a> Directory<'a> {
    /// The first directory.
    pub(super) fn first(bytes: &'a [u8]) -> Option<Self> {
        let is_big_endian = match bytes.get(..4)? {
            b"II*\0" => false,
            b"MM\0*" => true,
            _ => return None,
        };
        let file = Self {
            bytes,
            entries: &[],
            is_big_endian,
        };
        file.at(file.u32(bytes.get(4..8)?)?)
    }

    /// The directory that an entry points to.
    pub(super) fn below(&self, tag: u16) -> Option<Self> {
        self.at(self.number(tag)?)
    }

    fn at(&self, offset: u32) -> Option<Self> {
        let start = usize::try_from(offset).ok()?;
        let count = usize::from(self.u16(self.bytes.get(start..start.checked_add(2)?)?)?);
        let rest = self.bytes.get(start + 2..)?;
        Some(Self {
            entries: rest.get(..count * ENTRY)?,
            ..*self
        })
    }

    /// Whether it has an entry.
    pub(super) fn has(&self, tag: u16) -> bool {
        self.entry(tag).is_some()
    }

    /// The first number of an entry of integers.
    pub(super) fn number(&self, tag: u16) -> Option<u32> {
        let entry = self.entry(tag)?;
        match self.u16(&entry[2..4])? {
            // BYTE, SHORT and LONG, or a directory's place.
            1 => Some(u32::from(entry[8])),
            3 => Some(u32::from(self.u16(&entry[8..10])?)),
            4 | 13 => self.u32(&entry[8..12]),
            _ => None,
        }
    }

    /// The text of an entry of up to four bytes.
    pub(super) fn short_text(&self, tag: u16) -> Option<&'a [u8]> {
        let text = self.entry(tag)?.get(8..12)?;
        Some(text.split(|&byte| byte == 0).next().unwrap_or(text))
    }

    fn entry(&self, tag: u16) -> Option<&'a [u8]> {
        let mut entries = self.entries.chunks_exact(ENTRY);
        entries.find(|entry| self.u16(&entry[..2]) == Some(tag))
    }

    fn u16(&self, bytes: &[u8]) -> Option<u16> {
        let bytes = bytes.try_into().ok()?;
        Some(if self.is_big_endian {
            u16::from_be_bytes(bytes)
        } else {
            u16::from_le_bytes(bytes)
        })
    }

    fn u32(&self, bytes: &[u8]) -> Option<u32> {
        let bytes = bytes.try_into().ok()?;
        Some(if self.is_big_endian {
            u32::from_be_bytes(bytes)
        } else {
            u32::from_le_bytes(bytes)
        })
    }
}
