//! The checksums of FFV1. FFmpeg covers a slice whose checksum is wrong up with the one of the
//! frame before, and says so in its log only.
//!
//! RFC 9043, sections 4.8 and 4.9: a packet is a row of slices, each followed by its size (3 bytes)
//! and, where the stream has error checking, a status byte and a CRC (4 bytes) over all of it.

/// Size, status and CRC.
const FOOTER: usize = 8;

/// Whether all slices of a packet have the checksum that stands behind them; `None` where the
/// packet is not a row of slices with checksums.
pub(super) fn slices_are_whole(packet: &[u8]) -> Option<bool> {
    let mut rest = packet;
    let mut whole = true;
    while !rest.is_empty() {
        let footer = rest.len().checked_sub(FOOTER)?;
        let size = rest[footer..footer + 3]
            .iter()
            .fold(0, |size, &byte| size << 8 | usize::from(byte));
        let begin = footer.checked_sub(size)?;
        whole &= crc(&rest[begin..]) == 0;
        rest = &rest[..begin];
    }
    (!packet.is_empty()).then_some(whole)
}

/// Polynomial 0x04C11DB7, the highest bit first, from 0: it comes to 0 over data and their own CRC.
fn crc(bytes: &[u8]) -> u32 {
    bytes.iter().fold(0, |crc, &byte| {
        (crc << 8) ^ TABLE[((crc >> 24) as u8 ^ byte) as usize]
    })
}

const TABLE: [u32; 256] = {
    let mut table = [0; 256];
    let mut at = 0;
    while at < 256 {
        let mut value = (at as u32) << 24;
        let mut bit = 0;
        while bit < 8 {
            value = if value & 0x8000_0000 == 0 {
                value << 1
            } else {
                value << 1 ^ 0x04C1_1DB7
            };
            bit += 1;
        }
        table[at] = value;
        at += 1;
    }
    table
};

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn slice(data: &[u8]) -> Vec<u8> {
        let mut slice = [data, &(data.len() as u32).to_be_bytes()[1..], &[0]].concat();
        slice.extend(crc(&slice).to_be_bytes());
        slice
    }

    proptest! {
        #[test]
        fn any_flipped_bit_is_found(
            data in prop::collection::vec(prop::collection::vec(any::<u8>(), 1..40), 1..4),
            at in any::<prop::sample::Index>(), bit in 0..8,
        ) {
            let mut packet: Vec<u8> = data.iter().flat_map(|data| slice(data)).collect();
            prop_assert_eq!(slices_are_whole(&packet), Some(true));
            let at = at.index(packet.len());
            packet[at] ^= 1_u8 << bit;
            prop_assert_ne!(slices_are_whole(&packet), Some(true));
        }

        #[test]
        fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..64)) {
            slices_are_whole(&bytes);
        }
    }
}
